#pragma once

#include <span>
#include <vector>

#include "raster/raster_compare.h"
#include "raster/rasterizer_harness.h"

namespace splat::test {

/// One rasterizer and its scene, for tests that call it more than once. Failures of anything but
/// the calls under test are recorded as test failures.
class RasterSession {
  public:
    RasterSession(vk::Context& context, const RasterCase& from, const raster::RasterDesc& desc);

    /// Whether it could be made; nothing else may be called if not.
    [[nodiscard]] const Status& status() const { return status_; }
    [[nodiscard]] raster::Rasterizer& rasterizer() { return *rasterizer_; }
    [[nodiscard]] raster::PackedBuffers& scene() { return packed_.scene; }

    /// With the cameras given, or that of the case in every view.
    Status forward(std::uint64_t version = 0);
    Status forward(std::span<const scene::Camera> cameras, std::uint64_t version = 0);
    /// Another scene of the same size.
    Status draw(const raster::PackedGaussians& scene, std::span<const scene::Camera> cameras);

    /// From weights on the image [V,H,W,4], and on the depth [V,H,W] or none.
    Status backward(const std::vector<float>& grad_image,
                    const std::vector<float>& grad_depth = {});

    std::vector<float> image();
    std::vector<float> exported();

    /// Those of the Gaussians, then those of the colours.
    std::vector<float> gradients();

    std::array<float, 3> background{};

  private:
    vk::Context& context_;
    std::size_t count_;
    std::vector<scene::Camera> cameras_;
    PackedCase packed_;
    std::unique_ptr<raster::Rasterizer> rasterizer_;
    Status status_;
};

/// The image of one call; empty, with a test failure, if it fails.
std::vector<float> raster_image(vk::Context& context, const RasterCase& from,
                                const raster::RasterDesc& desc);

/// The description with everything that a backward call can give.
raster::RasterDesc with_gradients(raster::RasterDesc desc);

/// The greatest difference of two tensors relative to the largest number of the second.
double relative_difference(std::span<const float> got, std::span<const float> expected);

/// What expect_like_reference found, for tests that want to know that there was something.
struct ReferenceRun {
    RasterRun run;
    double fragile = 0;  ///< share of the pixels
};

/// All outputs and all gradients of a case against the float64 reference, with the figures of
/// tests/support/raster_tolerances.h; weights of the loss on RGB, alpha and depth.
///
/// or_float32  gradients that miss their figure may also be as near as kRasterOfFloat32 says
ReferenceRun expect_like_reference(vk::Context& context, const RasterCase& from,
                                   const RasterMode& mode,
                                   ref::RasterGradient gradient = ref::RasterGradient::kTrue,
                                   bool or_float32 = false);

}  // namespace splat::test

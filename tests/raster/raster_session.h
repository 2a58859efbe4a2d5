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

    /// True if creation succeeded. If not, call nothing else.
    [[nodiscard]] const Status& status() const { return status_; }
    [[nodiscard]] raster::Rasterizer& rasterizer() { return *rasterizer_; }
    [[nodiscard]] gaussians::GaussianSet& scene() { return packed_.scene; }

    /// Draws with these cameras, or with the case's camera in every view.
    Status forward(std::uint64_t version = 0);
    Status forward(std::span<const scene::Camera> cameras, std::uint64_t version = 0);
    /// Draws another scene of the same size.
    Status draw(const gaussians::SetViews& scene, std::span<const scene::Camera> cameras);

    /// Runs backward with weights on the image [V,H,W,4] and, if not empty, on the depth [V,H,W].
    Status backward(const std::vector<float>& grad_image,
                    const std::vector<float>& grad_depth = {});

    std::vector<float> image();
    std::vector<float> exported();

    /// Gradients by the Gaussians, then by the colours.
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

/// The image of one call. If the call fails, the test fails and the image is empty.
std::vector<float> raster_image(vk::Context& context, const RasterCase& from,
                                const raster::RasterDesc& desc);

/// The description with all gradients enabled.
raster::RasterDesc with_gradients(raster::RasterDesc desc);

/// Largest difference of two tensors, relative to the largest number of the second.
double relative_difference(std::span<const float> got, std::span<const float> expected);

/// Findings of expect_like_reference, for tests that check that it compared something.
struct ReferenceRun {
    RasterRun run;
    double fragile = 0;  ///< share of the pixels
};

/// Compare all outputs and gradients of a case with the float64 reference, within the figures of
/// tests/support/raster_tolerances.h. The loss has weights on RGB, alpha and depth.
///
/// or_float32  also accept gradients within kRasterOfFloat32 of the float32 reference's errors
ReferenceRun expect_like_reference(vk::Context& context, const RasterCase& from,
                                   const RasterMode& mode,
                                   ref::RasterGradient gradient = ref::RasterGradient::kTrue,
                                   bool or_float32 = false);

}  // namespace splat::test

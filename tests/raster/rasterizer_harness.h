#pragma once

#include <vector>

#include "raster/raster_outputs.h"
#include "raster/rasterizer.h"
#include "support/gpu_env.h"

/// The kernels, called like the reference and the golden files: with one RasterCase and one mode.
namespace splat::test {

struct RasterRun {
    Status status;
    RasterOutputs outputs;
    RasterGradients gradients;  ///< if a loss was given
    raster::RasterStats stats;
    std::vector<float> image;   ///< [V,H,W,4] of the first call, for bit comparisons
    std::vector<float> packed;  ///< gradients as the kernels left them
};

/// The description for a case and a mode. Tests change the fields that they test.
raster::RasterDesc raster_desc(const RasterCase& from, const RasterMode& mode);

/// A case's scene packed on the device, and room for its gradients.
struct PackedCase {
    gaussians::GaussianSet scene, gradients;

    static Result<PackedCase> create(vk::Context& context, const RasterCase& from,
                                     const raster::RasterDesc& desc);
};

scene::Camera camera_of(const RasterCase& from);

/// Forward, and backward if `loss` is not null. Unless desc.backward is set, all gradients are asked for.
RasterRun run_raster(vk::Context& context, const RasterCase& from, raster::RasterDesc desc,
                     const ref::RasterLoss<double>* loss = nullptr);

}  // namespace splat::test

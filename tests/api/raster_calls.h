#pragma once

#include "api/api_calls.h"

/// Scenes and rasterizers through the C API, for its tests.
namespace splat::test {

/// n Gaussians of degree `sh_degree` in front of a camera that looks along +z, with the same
/// numbers on every machine. The arrays hold the stored parameters.
struct SampleScene {
    explicit SampleScene(std::size_t count, std::uint32_t sh_degree = 1);
    [[nodiscard]] splat_scene_desc desc() const;
    [[nodiscard]] Scene create() const;

    std::uint32_t sh_degree;
    Floats means, log_scales, rotations, opacity_logits, sh;
};

/// A camera of this size at z = -4 that sees the sample scene.
splat_camera sample_camera(std::uint32_t width, std::uint32_t height, double angle = 0);

splat_rasterizer_desc rasterizer_desc(std::uint32_t gaussians, std::uint32_t width,
                                      std::uint32_t height, std::uint32_t flags = 0,
                                      std::uint32_t views = 0);
Rasterizer make_rasterizer(splat_device device, const splat_rasterizer_desc& desc);
/// A forward call of these cameras.
splat_result draw(splat_rasterizer rasterizer, splat_scene scene, const splat_camera& camera,
                  const float* background = nullptr);
splat_result draw(splat_rasterizer rasterizer, const splat_gaussians_desc& gaussians,
                  const splat_camera& camera, const float* background = nullptr);
RasterState make_state(splat_rasterizer rasterizer);

/// An output in host memory.
Floats output(splat_rasterizer rasterizer, splat_output which, std::size_t elements,
              splat_raster_state state = nullptr);

/// An empty scene.
Scene empty_scene();

/// The attributes of a scene as the tensors that splat_rasterizer_forward takes.
struct GaussianTensors {
    GaussianTensors(splat_device device, splat_scene scene);
    [[nodiscard]] splat_gaussians_desc desc() const;

    Tensor means, scales, rotations, opacities, sh;
};

std::string load_report(splat_scene scene);
splat_scene_info info_of(splat_scene scene);

}  // namespace splat::test

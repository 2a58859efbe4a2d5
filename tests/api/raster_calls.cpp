#include "api/raster_calls.h"

#include <cmath>

#include "support/rng_fill.h"

namespace splat::test {

SampleScene::SampleScene(std::size_t count, std::uint32_t degree)
    : sh_degree(degree),
      means(normal_fill(3 * count, 11)),
      log_scales(normal_fill(3 * count, 12)),
      rotations(normal_fill(4 * count, 13)),
      opacity_logits(normal_fill(count, 14)),
      sh(normal_fill(std::size_t{3} * (degree + 1) * (degree + 1) * count, 15)) {
    for (float& value : means) value *= 0.5F;
    for (float& value : log_scales) value = -2 + 0.3F * value;
    for (std::size_t i = 0; i < count; ++i) {
        float* const q = &rotations[4 * i];
        const float length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
        for (int k = 0; k < 4; ++k) q[k] /= length;
    }
}

splat_scene_desc SampleScene::desc() const {
    auto desc = sized<splat_scene_desc>();
    desc.count = opacity_logits.size();
    desc.sh_degree = sh_degree;
    desc.means = means.data();
    desc.log_scales = log_scales.data();
    desc.rotations = rotations.data();
    desc.opacity_logits = opacity_logits.data();
    desc.sh = sh.data();
    return desc;
}

Scene SampleScene::create() const {
    return got(splat_scene_create, desc());
}

splat_camera sample_camera(std::uint32_t width, std::uint32_t height, double angle) {
    splat_camera camera;
    EXPECT_DONE(splat_camera_from_fov(width, height, 0.8, &camera));
    const double eye[3] = {4 * std::sin(angle), 0.5, -4 * std::cos(angle)};
    const double target[3] = {0, 0, 0};
    const double up[3] = {0, -1, 0};
    EXPECT_DONE(splat_camera_look_at(&camera, eye, target, up));
    return camera;
}

splat_rasterizer_desc rasterizer_desc(std::uint32_t gaussians, std::uint32_t width,
                                      std::uint32_t height, std::uint32_t flags,
                                      std::uint32_t views) {
    auto desc = sized<splat_rasterizer_desc>();
    desc.flags = flags;
    desc.gaussians = gaussians;
    desc.views = views;
    desc.width = width;
    desc.height = height;
    desc.sh_degree = (flags & SPLAT_RASTERIZER_DIRECT_COLORS) != 0 ? 0 : 1;
    return desc;
}

Rasterizer make_rasterizer(splat_device device, const splat_rasterizer_desc& desc) {
    return got(splat_rasterizer_create, device, &desc);
}

splat_result draw(splat_rasterizer rasterizer, splat_scene scene, const splat_camera& camera,
                  const float* background) {
    return splat_rasterizer_forward_scene(rasterizer, nullptr, scene, &camera, 1, background);
}

splat_result draw(splat_rasterizer rasterizer, const splat_gaussians_desc& gaussians,
                  const splat_camera& camera, const float* background) {
    return splat_rasterizer_forward(rasterizer, nullptr, &gaussians, &camera, 1, background);
}

Scene empty_scene() {
    return got(splat_scene_create, sized<splat_scene_desc>());
}

RasterState make_state(splat_rasterizer rasterizer) {
    return got(splat_raster_state_create, rasterizer);
}

Floats output(splat_rasterizer rasterizer, splat_output which, std::size_t elements,
              splat_raster_state state) {
    return floats_of(elements, splat_rasterizer_read, rasterizer, state, which);
}

GaussianTensors::GaussianTensors(splat_device device, splat_scene scene)
    : means(got(splat_scene_to_tensor, scene, "means", device)),
      scales(got(splat_scene_to_tensor, scene, "scales", device)),
      rotations(got(splat_scene_to_tensor, scene, "rotations", device)),
      opacities(got(splat_scene_to_tensor, scene, "opacities", device)),
      sh(got(splat_scene_to_tensor, scene, "sh", device)) {}

splat_gaussians_desc GaussianTensors::desc() const {
    auto desc = sized<splat_gaussians_desc>();
    desc.means = means;
    desc.scales = scales;
    desc.rotations = rotations;
    desc.opacities = opacities;
    desc.sh = sh;
    return desc;
}

std::string load_report(splat_scene scene) {
    return text_of(splat_scene_load_report, scene);
}

splat_scene_info info_of(splat_scene scene) {
    return got(splat_scene_get_info, scene);
}

}  // namespace splat::test

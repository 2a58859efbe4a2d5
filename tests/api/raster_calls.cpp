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
    const splat_scene_desc made = desc();
    Scene scene;
    EXPECT_DONE(splat_scene_create(&made, scene.out()));
    return scene;
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
    Rasterizer rasterizer;
    EXPECT_DONE(splat_rasterizer_create(device, &desc, rasterizer.out()));
    return rasterizer;
}

RasterState make_state(splat_rasterizer rasterizer) {
    RasterState state;
    EXPECT_DONE(splat_raster_state_create(rasterizer, state.out()));
    return state;
}

std::vector<float> output(splat_rasterizer rasterizer, splat_output which, std::size_t elements,
                          splat_raster_state state) {
    std::vector<float> values(elements);
    EXPECT_DONE(
        splat_rasterizer_read(rasterizer, state, which, values.data(), elements * sizeof(float)));
    return values;
}

GaussianTensors::GaussianTensors(splat_device device, splat_scene scene) {
    EXPECT_DONE(splat_scene_to_tensor(scene, "means", device, means.out()));
    EXPECT_DONE(splat_scene_to_tensor(scene, "scales", device, scales.out()));
    EXPECT_DONE(splat_scene_to_tensor(scene, "rotations", device, rotations.out()));
    EXPECT_DONE(splat_scene_to_tensor(scene, "opacities", device, opacities.out()));
    EXPECT_DONE(splat_scene_to_tensor(scene, "sh", device, sh.out()));
}

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
    return whole_text([&](char* buffer, std::size_t capacity, std::size_t* needed) {
        return splat_scene_load_report(scene, buffer, capacity, needed);
    });
}

splat_scene_info info_of(splat_scene scene) {
    auto info = sized<splat_scene_info>();
    EXPECT_DONE(splat_scene_get_info(scene, &info));
    return info;
}

}  // namespace splat::test

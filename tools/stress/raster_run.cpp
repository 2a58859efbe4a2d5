#include "stress/raster_run.h"

#include <algorithm>

namespace vkrun::stress {
namespace {

std::vector<float> floats(const std::vector<double>& values) {
    return {values.begin(), values.end()};
}

splat_camera camera_of(const RasterScene& scene) {
    splat_camera camera{};
    camera.fx = static_cast<float>(scene.camera.fx);
    camera.fy = static_cast<float>(scene.camera.fy);
    camera.cx = static_cast<float>(scene.camera.cx);
    camera.cy = static_cast<float>(scene.camera.cy);
    camera.width = static_cast<std::uint32_t>(scene.camera.width);
    camera.height = static_cast<std::uint32_t>(scene.camera.height);
    for (std::size_t i = 0; i < 16; ++i)
        camera.world_to_camera[i] = static_cast<float>(scene.camera.world_to_camera[i]);
    return camera;
}

}  // namespace

RasterOnDevice::RasterOnDevice(splat_device device, const RasterScene& scene,
                               const RasterLoss& loss, std::uint32_t disabled_skips)
    : count_(scene.count()), pixels_(scene.pixels()), camera_(camera_of(scene)) {
    std::copy(scene.background.begin(), scene.background.end(), background_);
    const auto n = static_cast<std::int64_t>(count_);
    const auto terms = static_cast<std::int64_t>(scene.sh_coefficients);
    const auto add = [&](const char* name, const std::vector<std::int64_t>& dims,
                         const std::vector<double>& values) {
        inputs_[name] = make_tensor(device, name, dims, floats(values));
        if (!loss.grad_rgb.empty())
            gradients_[name] = make_tensor(device, std::string("grad_") + name, dims, {});
    };
    add("means", {n, 3}, scene.means);
    add("scales", {n, 3}, scene.scales);
    add("rotations", {n, 4}, scene.rotations);
    add("opacities", {n}, scene.opacities);
    add("sh", {n, terms, 3}, scene.sh);
    auto desc = sized<splat_rasterizer_desc>();
    desc.flags = SPLAT_RASTERIZER_DEPTH | SPLAT_RASTERIZER_NORMALS;
    if (!loss.grad_rgb.empty() && !scene.options.is_ray()) {
        desc.flags |= SPLAT_RASTERIZER_GRAD_DEPTH;
        const std::int64_t H = camera_.height;
        const std::int64_t W = camera_.width;
        weights_["rgb"] = make_tensor(device, "grad_rgb", {1, H, W, 3}, floats(loss.grad_rgb));
        weights_["alpha"] = make_tensor(device, "grad_alpha", {1, H, W}, floats(loss.grad_alpha));
        weights_["depth"] = make_tensor(device, "grad_depth", {1, H, W}, floats(loss.grad_depth));
    }
    if (scene.options.antialiased) desc.flags |= SPLAT_RASTERIZER_ANTIALIASED;
    if (scene.options.is_original()) desc.flags |= SPLAT_RASTERIZER_ORIGINAL_GRADIENT;
    desc.gaussians = static_cast<std::uint32_t>(count_);
    desc.width = camera_.width;
    desc.height = camera_.height;
    desc.sh_degree = scene.sh_coefficients > 1 ? 1 : 0;
    desc.convention = scene.options.is_3dgs()  ? SPLAT_CONVENTION_3DGS
                      : scene.options.is_ray() ? SPLAT_CONVENTION_RAY_MAXIMUM
                                               : SPLAT_CONVENTION_GSPLAT;
    rays_ = scene.options.is_ray();
    desc.disabled_skips = disabled_skips;
    check(splat_rasterizer_create(device, &desc, rasterizer_.out()));
}

void RasterOnDevice::forward() {
    auto gaussians = sized<splat_gaussians_desc>();
    gaussians.means = inputs_.at("means").get();
    gaussians.scales = inputs_.at("scales").get();
    gaussians.rotations = inputs_.at("rotations").get();
    gaussians.opacities = inputs_.at("opacities").get();
    gaussians.sh = inputs_.at("sh").get();
    check(
        splat_rasterizer_forward(rasterizer_.get(), nullptr, &gaussians, &camera_, 1, background_));
}

void RasterOnDevice::backward() {
    auto desc = sized<splat_gradients_desc>();
    desc.grad_rgb = weights_.at("rgb").get();
    desc.grad_alpha = weights_.at("alpha").get();
    desc.grad_depth = weights_.at("depth").get();
    desc.grad_means = gradients_.at("means").get();
    desc.grad_scales = gradients_.at("scales").get();
    desc.grad_rotations = gradients_.at("rotations").get();
    desc.grad_opacities = gradients_.at("opacities").get();
    desc.grad_sh = gradients_.at("sh").get();
    check(splat_rasterizer_backward(rasterizer_.get(), nullptr, &desc));
}

std::vector<float> RasterOnDevice::output(splat_output output, std::size_t count) const {
    std::vector<float> values(count);
    check(splat_rasterizer_read(rasterizer_.get(), nullptr, output, values.data(),
                                values.size() * sizeof(float)));
    return values;
}

RasterResults<float> RasterOnDevice::results() {
    forward();
    if (!rays_) backward();
    RasterResults<float> results;
    results["rgb"] = output(SPLAT_OUTPUT_RGB, 3 * pixels_);
    results["alpha"] = output(SPLAT_OUTPUT_ALPHA, pixels_);
    results["depth"] = output(SPLAT_OUTPUT_DEPTH, pixels_);
    results["normal"] = output(SPLAT_OUTPUT_NORMALS, 3 * pixels_);
    results["means2d"] = output(SPLAT_OUTPUT_MEANS2D, 2 * count_);
    if (!rays_) results["conics"] = output(SPLAT_OUTPUT_CONICS, 3 * count_);
    results["depths"] = output(SPLAT_OUTPUT_DEPTHS, count_);
    if (rays_) return results;
    for (const auto& [name, tensor] : gradients_)
        results["grad_" + name] = read_tensor(tensor.get());
    return results;
}

}  // namespace vkrun::stress

#include "vkrun/predict/drawing.h"

#include <algorithm>

#include "vkrun/cli/picture.h"

namespace vkrun {
namespace {

/// Images per call of the rasterizer: few calls, and little memory; fewer of large scenes, whose views share a binding.
std::uint32_t views_at_once(const Scene& scene, std::uint32_t views) {
    constexpr std::uint64_t kMost = 16, kGaussians = 1U << 20U;
    auto info = sized<splat_scene_info>();
    check(splat_scene_get_info(scene.get(), &info));
    const std::uint64_t most =
        std::clamp<std::uint64_t>(kGaussians / std::max<std::uint64_t>(info.count, 1), 1, kMost);
    return std::min(views, static_cast<std::uint32_t>(most));
}

Rasterizer make_rasterizer(splat_device device, const Scene& scene, const splat_camera& camera,
                           std::uint32_t views, std::uint32_t flags, splat_convention convention) {
    auto info = sized<splat_scene_info>();
    check(splat_scene_get_info(scene.get(), &info));
    auto desc = sized<splat_rasterizer_desc>();
    desc.flags = flags | info.drawn_as;
    desc.convention = convention;
    desc.gaussians = static_cast<std::uint32_t>(info.count);
    desc.sh_degree = info.sh_degree;
    desc.views = views;
    desc.width = camera.width;
    desc.height = camera.height;
    Rasterizer rasterizer;
    check(splat_rasterizer_create(device, &desc, rasterizer.out()));
    return rasterizer;
}

}  // namespace

std::vector<float> draw_scene(splat_device device, const Scene& scene,
                              const std::vector<splat_camera>& cameras, const float* background,
                              splat_convention convention) {
    const auto count = static_cast<std::uint32_t>(cameras.size());
    const std::uint32_t side = cameras.front().width;
    const std::uint32_t at_once = views_at_once(scene, count);
    const Rasterizer rasterizer =
        make_rasterizer(device, scene, cameras.front(), at_once, 0, convention);
    const std::size_t image = std::size_t{3} * side * side;
    std::vector<float> images(count * image);
    for (std::uint32_t first = 0; first < count; first += at_once) {
        const std::uint32_t views = std::min(at_once, count - first);
        check(splat_rasterizer_forward_scene(rasterizer.get(), nullptr, scene.get(),
                                             &cameras[first], views, background));
        std::vector<splat_image> drawn;
        for (std::uint32_t i = 0; i < views; ++i)
            drawn.push_back(planar_image(&images[(first + i) * image], side, 3));
        check(splat_rasterizer_read_images(rasterizer.get(), nullptr, SPLAT_OUTPUT_RGB, 0,
                                           drawn.data(), views));
    }
    return images;
}

Depth draw_scene_depth(splat_device device, const Scene& scene, const splat_camera& camera,
                       const float* background, splat_convention convention) {
    const Rasterizer rasterizer =
        make_rasterizer(device, scene, camera, 1, SPLAT_RASTERIZER_DEPTH, convention);
    check(splat_rasterizer_forward_scene(rasterizer.get(), nullptr, scene.get(), &camera, 1,
                                         background));
    Depth drawn;
    drawn.depth.resize(std::size_t{camera.width} * camera.height);
    drawn.alpha.resize(drawn.depth.size());
    const std::size_t bytes = drawn.depth.size() * sizeof(float);
    check(splat_rasterizer_read(rasterizer.get(), nullptr, SPLAT_OUTPUT_EXPECTED_DEPTH,
                                drawn.depth.data(), bytes));
    check(splat_rasterizer_read(rasterizer.get(), nullptr, SPLAT_OUTPUT_ALPHA, drawn.alpha.data(),
                                bytes));
    return drawn;
}

}  // namespace vkrun

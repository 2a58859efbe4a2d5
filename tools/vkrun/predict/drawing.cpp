#include "vkrun/predict/drawing.h"

#include <algorithm>

namespace vkrun {
namespace {

/// Images per call of the rasterizer: few calls, and little memory.
constexpr std::uint32_t kViewsAtOnce = 16;

Rasterizer make_rasterizer(splat_device device, const Scene& scene, const splat_camera& camera,
                           std::uint32_t views, std::uint32_t flags) {
    auto info = sized<splat_scene_info>();
    check(splat_scene_get_info(scene.get(), &info));
    auto desc = sized<splat_rasterizer_desc>();
    desc.flags = flags;
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
                              const std::vector<splat_camera>& cameras, const float* background) {
    const Rasterizer rasterizer = make_rasterizer(device, scene, cameras.front(), kViewsAtOnce, 0);
    const std::size_t area = std::size_t{cameras.front().width} * cameras.front().height;
    std::vector<float> pixels(kViewsAtOnce * area * 3);
    std::vector<float> images(cameras.size() * area * 3);
    for (std::size_t first = 0; first < cameras.size(); first += kViewsAtOnce) {
        // The last group is filled up with its last camera.
        std::vector<splat_camera> group;
        for (std::size_t i = 0; i < kViewsAtOnce; ++i)
            group.push_back(cameras[std::min(first + i, cameras.size() - 1)]);
        check(splat_rasterizer_forward_scene(rasterizer.get(), nullptr, scene.get(), group.data(),
                                             kViewsAtOnce, background));
        check(splat_rasterizer_read(rasterizer.get(), nullptr, SPLAT_OUTPUT_RGB, pixels.data(),
                                    pixels.size() * sizeof(float)));
        const std::size_t count = std::min<std::size_t>(kViewsAtOnce, cameras.size() - first);
        for (std::size_t i = 0; i < count; ++i)
            for (std::size_t p = 0; p < area; ++p)
                for (std::size_t c = 0; c < 3; ++c)
                    images[(3 * (first + i) + c) * area + p] = pixels[3 * (i * area + p) + c];
    }
    return images;
}

Depth draw_scene_depth(splat_device device, const Scene& scene, const splat_camera& camera,
                       const float* background) {
    const Rasterizer rasterizer = make_rasterizer(device, scene, camera, 1, SPLAT_RASTERIZER_DEPTH);
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

#pragma once

#include <gtest/gtest.h>

#include "io/image.h"
#include "io/transforms_json.h"
#include "raster/pack_camera.h"
#include "raster/rasterizer.h"
#include "scene/arrays.h"
#include "scene/orbit.h"
#include "support/expect_status.h"
#include "support/gpu_env.h"
#include "support/rng_fill.h"
#include "synthetic/sample_folder.h"

/// Photographs to fit: coloured blobs from an orbit.
namespace splat::test {

inline constexpr std::uint32_t kViews = 16, kWidth = 75, kHeight = 58;  // no multiples of 16

/// Coloured blobs.
inline scene::Gaussians blobs() {
    constexpr std::size_t kBlobs = 60;
    scene::Gaussians scene = scene::make_gaussians(kBlobs, 0);
    scene.means = normal_fill(3 * kBlobs, 1);
    scene.log_scales = normal_fill(3 * kBlobs, 2, -1.5, 0.3);
    scene.rotations = normal_fill(4 * kBlobs, 3);
    scene.opacity_logits = normal_fill(kBlobs, 4, 2, 0.5);
    scene.sh = normal_fill(3 * kBlobs, 5);
    return scene;
}

inline std::vector<scene::Camera> blob_cameras() {
    auto cameras =
        scene::orbit(blobs(), {.count = kViews, .width = kWidth, .height = kHeight}).value();
    for (std::size_t i = 0; i < cameras.size(); ++i)
        cameras[i].name = format("images/%02zu.png", i);
    return cameras;
}

/// The blobs from each camera, [height,width,3].
inline std::vector<std::vector<float>> blob_pictures(const std::vector<scene::Camera>& cameras) {
    vk::Context* const context = shared_context();
    const scene::Gaussians scene = blobs();
    raster::RasterDesc desc;
    desc.gaussians = static_cast<std::uint32_t>(scene.count());
    desc.width = kWidth;
    desc.height = kHeight;
    desc.convention = raster::Convention::kGsplat;
    const auto rasterizer = need(raster::Rasterizer::create(*context, desc));
    gaussians::GaussianSet set = need(gaussians::allocate_set(*context, desc));
    EXPECT_OK(gaussians::upload(*context, scene, set));
    std::vector<std::vector<float>> pictures;
    for (const scene::Camera& camera : cameras) {
        EXPECT_OK(
            rasterizer->forward(set.views(), need(raster::pack_views(desc, {&camera, 1}, {}))));
        std::vector<float> quads(std::size_t{4} * kWidth * kHeight);
        EXPECT_OK(context->read(rasterizer->workspace().image.range(), quads.data(),
                                quads.size() * sizeof(float)));
        std::vector<float>& rgb = pictures.emplace_back();
        for (std::size_t pixel = 0; pixel < quads.size(); pixel += 4)
            rgb.insert(rgb.end(), &quads[pixel], &quads[pixel] + 3);
    }
    return pictures;
}

/// Photographs with their cameras, as a transforms.json names them.
inline void write_photographs(const std::filesystem::path& folder) {
    const std::vector<scene::Camera> cameras = blob_cameras();
    const std::vector<std::vector<float>> pictures = blob_pictures(cameras);
    for (std::size_t i = 0; i < cameras.size(); ++i)
        put_png(folder / cameras[i].name, io::image_from_floats(pictures[i], kWidth, kHeight, 3));
    put_text(folder / "transforms.json",
             std::string(io::as_text(need(io::write_transforms_json(cameras)))));
}

}  // namespace splat::test

// A scene that is drawn band by band has the pixels of one that is drawn at once, to the bit.
#include "raster/bands.h"

#include <gtest/gtest.h>

#include <cmath>

#include "ops/op_harness.h"
#include "raster/raster_scenes.h"
#include "raster/rasterizer_harness.h"
#include "scene/activate.h"
#include "scene/arrays.h"
#include "support/expect_status.h"
#include "support/gpu_buffers.h"

namespace splat::test {
namespace {

class RasterizerBands : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(RasterizerBands);

/// The case in the parameters of scenes; smaller Gaussians, so that not every row of tiles needs nearly all of them.
scene::Gaussians scene_of(const RasterCase& from) {
    scene::Gaussians scene;
    while (scene::sh_coefficients(scene.sh_degree) < from.sh_coefficients) ++scene.sh_degree;
    scene.means = from.means;
    scene.rotations = from.rotations;
    scene.sh = from.sh;
    for (const float value : from.scales) scene.log_scales.push_back(std::log(0.25F * value));
    for (const float value : from.opacities)
        scene.opacity_logits.push_back(
            static_cast<float>(scene::logit_of(static_cast<double>(value))));
    return scene;
}

struct Pictures {
    std::vector<float> image, extra, normals;
    raster::RasterStats stats;
};

Pictures drawn_by(vk::Context& context, const raster::Rasterizer& rasterizer) {
    const raster::Workspace& space = rasterizer.workspace();
    const std::size_t numbers = 4 * rasterizer.desc().pixels();
    return {download(context, space.image.range(), numbers),
            download(context, space.extra.range(), numbers),
            download(context, space.normal_image.range(), numbers), rasterizer.stats()};
}

Pictures draw_whole(vk::Context& context, const scene::Gaussians& scene,
                    const raster::RasterDesc& desc, const raster::PackedViews& views) {
    auto set = need(gaussians::allocate_set(context, desc));
    EXPECT_OK(gaussians::upload(context, scene, set));
    const auto rasterizer = need(raster::Rasterizer::create(context, desc));
    EXPECT_OK(rasterizer->forward(set.views(), views));
    return drawn_by(context, *rasterizer);
}

/// With the least of the tried room that a row of tiles leaves; at least two bands.
Pictures draw_in_bands(vk::Context& context, const scene::Gaussians& scene, raster::RasterDesc desc,
                       const raster::PackedViews& views) {
    std::size_t most = 0;
    Result<raster::Bands> bands = raster::divide(scene, desc, views, most);
    EXPECT_ERROR(bands, Code::kUnsupported, "may reach one row of tiles");
    while (!bands.ok()) bands = raster::divide(scene, desc, views, most += scene.count() / 16);
    EXPECT_GE(bands.value().rows.size(), 2U) << most << " of " << scene.count();
    desc.gaussians = static_cast<std::uint32_t>(most);
    auto set = need(gaussians::allocate_set(context, desc));
    const auto rasterizer = need(raster::Rasterizer::create(context, desc));
    const auto load = [&](const raster::Window& band) -> Result<gaussians::SetViews> {
        const scene::Gaussians part = scene::gather(scene, bands.value().gaussians_of(band));
        SPLAT_TRY(gaussians::upload(context, part, set));
        return set.views();
    };
    EXPECT_OK(rasterizer->forward_in_bands(scene.count(), bands.value().rows, load, views));
    EXPECT_TRUE(rasterizer->drawn());
    EXPECT_EQ(rasterizer->stats().banded, scene.count());
    return drawn_by(context, *rasterizer);
}

TEST_P(RasterizerBands, GiveTheSameBits) {
    const SceneSize size = {1200, 40, 144};  // nine rows of tiles
    const RasterCase cases[] = {random_scene(size, 11, 2), needle_scene(size, 12, 0.5),
                                tie_scene(size, 13), hostile_scene(size, 14).with,
                                opaque_scene(size, 15)};
    std::vector<RasterMode> modes(std::begin(kRasterModes), std::end(kRasterModes));
    modes.push_back(kRayModes[0]);
    for (const RasterCase& from : cases)
        for (const RasterMode& mode : modes) {
            SCOPED_TRACE(from.name + " " + mode.name);
            const scene::Gaussians scene = scene_of(from);
            const raster::RasterDesc desc = raster_desc(from, mode);
            const scene::Camera camera = camera_of(from);
            const auto views = need(raster::pack_views(desc, {&camera, 1}, from.background));
            const Pictures whole = draw_whole(context(), scene, desc, views);
            const Pictures banded = draw_in_bands(context(), scene, desc, views);
            EXPECT_EQ(whole.image, banded.image);
            EXPECT_EQ(whole.extra, banded.extra);
            EXPECT_EQ(whole.normals, banded.normals);
            EXPECT_EQ(whole.stats.pairs, banded.stats.pairs);
            EXPECT_EQ(whole.stats.longest, banded.stats.longest);
            EXPECT_EQ(whole.stats.empty_tiles, banded.stats.empty_tiles);
            EXPECT_GT(whole.stats.pairs, 0U);
        }
}

}  // namespace
}  // namespace splat::test

// Views smaller than the rasterizer, and tiles that are off.
#include <gtest/gtest.h>

#include "ops/op_harness.h"
#include "raster/raster_scenes.h"
#include "raster/raster_session.h"
#include "support/gpu_buffers.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

class RasterizerSizes : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(RasterizerSizes);

using Mask = std::vector<std::uint8_t>;

struct ViewSize {
    std::uint32_t width, height;
};

/// Quads or numbers of pixels, `channels` each: a view of `all`, cut to the corner of `size`.
std::vector<float> corner_of(const std::vector<float>& all, const raster::RasterDesc& desc,
                             std::size_t view, ViewSize size, std::size_t channels) {
    std::vector<float> part;
    for (std::size_t row = 0; row < size.height; ++row) {
        const std::size_t first = ((view * desc.height + row) * desc.width) * channels;
        const auto from = all.begin() + static_cast<std::ptrdiff_t>(first);
        part.insert(part.end(), from, from + static_cast<std::ptrdiff_t>(size.width * channels));
    }
    return part;
}

/// Everything that a forward and a backward call wrote.
struct SizedDraw {
    std::vector<float> image, extra, normals, exported, pose, intrinsics, contributions, gradients;
    raster::RasterStats stats;

    /// Compare what is not by pixel.
    void expect_gradients(const SizedDraw& other) const {
        EXPECT_EQ(exported, other.exported);
        EXPECT_EQ(pose, other.pose);
        EXPECT_EQ(intrinsics, other.intrinsics);
        EXPECT_EQ(contributions, other.contributions);
        EXPECT_EQ(gradients, other.gradients);
        EXPECT_EQ(stats.pairs, other.stats.pairs);
        EXPECT_EQ(stats.visible, other.stats.visible);
    }
};

SizedDraw draw_sized(vk::Context& context, RasterSession& session,
                     std::span<const scene::Camera> cameras, const std::vector<float>& grad_image,
                     const std::vector<float>& grad_depth, const Mask& mask = {}) {
    SizedDraw drawn;
    raster::Rasterizer& rasterizer = session.rasterizer();
    auto views = need(raster::pack_views(rasterizer.desc(), cameras, session.background));
    if (!mask.empty()) {
        EXPECT_OK(raster::mask_tiles(rasterizer.desc(), mask, views));
    }
    EXPECT_OK(rasterizer.forward(session.scene().views(), views));
    EXPECT_OK(session.backward(grad_image, grad_depth));
    const raster::RasterDesc& desc = rasterizer.drawn_desc();
    const raster::Workspace& space = rasterizer.workspace();
    drawn.image = download(context, space.image.range(), 4 * desc.pixels());
    drawn.extra = download(context, space.extra.range(), 4 * desc.pixels());
    drawn.normals = download(context, space.normal_image.range(), 4 * desc.pixels());
    drawn.exported = download(context, space.exported.range(), 12 * desc.items());
    drawn.pose = download(context, space.pose.range(), std::size_t{12} * desc.views);
    drawn.intrinsics = download(context, space.intrinsics.range(), std::size_t{4} * desc.views);
    drawn.contributions =
        download(context, space.contributions.range(), std::size_t{2} * desc.gaussians);
    drawn.gradients = session.gradients();
    drawn.stats = rasterizer.stats();
    return drawn;
}

raster::RasterDesc sized_desc(const RasterCase& scene, const RasterMode& mode,
                              std::uint32_t views) {
    raster::RasterDesc desc = with_gradients(raster_desc(scene, mode));
    desc.ids = true;
    desc.views = views;
    return desc;
}

scene::Camera smaller_camera(const scene::Camera& from, ViewSize size) {
    scene::Camera camera = from;
    camera.width = size.width;
    camera.height = size.height;
    camera.cx -= 0.4 * (from.width - size.width);
    return camera;
}

void expect_sizes(vk::Context& context, const RasterCase& scene, const RasterMode& mode) {
    RasterSession many(context, scene, sized_desc(scene, mode, 3));
    ASSERT_OK(many);
    const raster::RasterDesc& desc = many.rasterizer().desc();
    const ViewSize sizes[] = {{desc.width, desc.height}, {37, 29}, {61, 16}};
    const std::vector<float> grad_image = normal_fill(4 * desc.pixels(), 1);
    const std::vector<float> grad_depth = normal_fill(desc.pixels(), 2);
    std::vector<scene::Camera> cameras;
    for (const ViewSize& size : sizes) cameras.push_back(smaller_camera(camera_of(scene), size));
    const std::span<const scene::Camera> first(cameras.data(), 1);
    const std::vector<float> first_image = corner_of(grad_image, desc, 0, sizes[0], 4);
    const std::vector<float> first_depth = corner_of(grad_depth, desc, 0, sizes[0], 1);
    const SizedDraw whole = draw_sized(context, many, first, first_image, first_depth);
    const SizedDraw all = draw_sized(context, many, cameras, grad_image, grad_depth);
    for (std::size_t v = 0; v < 3; ++v) {
        SCOPED_TRACE(v);
        RasterCase exact_scene = scene;
        exact_scene.camera.width = sizes[v].width;
        exact_scene.camera.height = sizes[v].height;
        RasterSession exact(context, exact_scene, sized_desc(exact_scene, mode, 1));
        ASSERT_OK(exact);
        const std::span<const scene::Camera> camera(&cameras[v], 1);
        const SizedDraw expected =
            draw_sized(context, exact, camera, corner_of(grad_image, desc, v, sizes[v], 4),
                       corner_of(grad_depth, desc, v, sizes[v], 1));
        EXPECT_EQ(corner_of(all.image, desc, v, sizes[v], 4), expected.image);
        EXPECT_EQ(corner_of(all.extra, desc, v, sizes[v], 4), expected.extra);
        EXPECT_EQ(corner_of(all.normals, desc, v, sizes[v], 4), expected.normals);
        EXPECT_EQ(std::vector(all.pose.begin() + 12 * static_cast<std::ptrdiff_t>(v),
                              all.pose.begin() + 12 * static_cast<std::ptrdiff_t>(v + 1)),
                  expected.pose);
        const ViewSize full = sizes[0];
        const SizedDraw alone =
            draw_sized(context, many, camera, corner_of(grad_image, desc, v, full, 4),
                       corner_of(grad_depth, desc, v, full, 1));
        alone.expect_gradients(expected);
        for (std::size_t p = 0; p < alone.image.size(); ++p) {
            const std::size_t column = p / 4 % desc.width;
            const std::size_t row = p / 4 / desc.width;
            if (column < sizes[v].width && row < sizes[v].height) continue;
            ASSERT_EQ(alone.image[p], 0) << column << ", " << row;
            ASSERT_EQ(alone.normals[p], 0);
            ASSERT_EQ(alone.extra[p], p % 4 == 3 ? -1.0F : 0.0F);
        }
    }
    const SizedDraw again = draw_sized(context, many, first, first_image, first_depth);
    EXPECT_EQ(again.image, whole.image);
    again.expect_gradients(whole);
}

TEST_P(RasterizerSizes, SmallerViewsAreThoseOfExactRasterizers) {
    expect_sizes(context(), random_scene({60, 61, 53}, 110, 1), kRasterModes[0]);
    expect_sizes(context(), random_scene({60, 61, 53}, 111, 1), kRasterModes[2]);
}

TEST_P(RasterizerSizes, LargeFootprintsEndWithTheView) {
    RasterCase scene = random_scene({12, 290, 120}, 112, 1);
    for (float& scale : scene.scales) scale *= 6;
    expect_sizes(context(), scene, kRasterModes[1]);
}

/// Tiles [2,ty,tx], about half of them, and in the second view all but one.
Mask mask_of(const raster::RasterDesc& desc, std::uint64_t seed) {
    const std::size_t tiles = std::size_t{desc.tiles_x()} * desc.tiles_y();
    Mask mask(2 * tiles);
    const std::vector<float> noise = normal_fill(tiles, seed);
    for (std::size_t i = 0; i < tiles; ++i) mask[i] = noise[i] > 0 ? 255 : 0;
    mask[tiles + tiles / 2] = 1;
    return mask;
}

/// Sets pixels [2,H,W,channels] of tiles that are off to the values of `off`.
std::vector<float> with_masked(std::vector<float> values, const raster::RasterDesc& desc,
                               const Mask& mask, const std::vector<float>& off) {
    for (std::size_t i = 0; i < values.size(); ++i) {
        const std::size_t pixel = i / off.size();
        const std::size_t row = pixel / desc.width % desc.height;
        const std::size_t view = pixel / desc.width / desc.height;
        const std::size_t tile =
            (view * desc.tiles_y() + row / 16) * desc.tiles_x() + pixel % desc.width / 16;
        if (mask[tile] == 0) values[i] = off[i % off.size()];
    }
    return values;
}

void expect_masked(vk::Context& context, const RasterCase& scene, const RasterMode& mode) {
    RasterSession session(context, scene, sized_desc(scene, mode, 2));
    ASSERT_OK(session);
    const raster::RasterDesc& desc = session.rasterizer().desc();
    std::vector<scene::Camera> cameras(2, camera_of(scene));
    cameras[1].world_to_camera[3] += 0.2;
    const Mask mask = mask_of(desc, 3);
    const std::vector<float> image = normal_fill(4 * desc.pixels(), 1);
    const std::vector<float> depth = normal_fill(desc.pixels(), 2);
    const std::vector<float> no_image(4, 0.0F);
    const SizedDraw whole =
        draw_sized(context, session, cameras, with_masked(image, desc, mask, no_image),
                   with_masked(depth, desc, mask, {0}));
    const SizedDraw part = draw_sized(context, session, cameras, image, depth, mask);
    const auto& b = session.background;
    EXPECT_EQ(part.image, with_masked(whole.image, desc, mask, {b[0], b[1], b[2], 0}));
    EXPECT_EQ(part.extra, with_masked(whole.extra, desc, mask, {0, 0, 0, -1}));
    EXPECT_EQ(part.normals, with_masked(whole.normals, desc, mask, no_image));
    EXPECT_EQ(part.exported, whole.exported);
    EXPECT_EQ(part.pose, whole.pose);
    EXPECT_EQ(part.intrinsics, whole.intrinsics);
    EXPECT_EQ(part.gradients, whole.gradients);
    EXPECT_LT(part.stats.pairs, whole.stats.pairs);
    EXPECT_GT(part.stats.pairs, 0U);
    const Mask all(mask.size(), 1);
    const SizedDraw on = draw_sized(context, session, cameras, image, depth, all);
    const SizedDraw without = draw_sized(context, session, cameras, image, depth);
    EXPECT_EQ(without.image, whole.image);
    EXPECT_EQ(on.image, whole.image);
    on.expect_gradients(without);
    EXPECT_EQ(without.stats.pairs, whole.stats.pairs);
}

TEST_P(RasterizerSizes, TilesThatAreOffAreTheBackgroundAndPassNoGradient) {
    expect_masked(context(), random_scene({70, 100, 70}, 113, 1), kRasterModes[0]);
    expect_masked(context(), random_scene({70, 100, 70}, 114, 1), kRasterModes[2]);
}

TEST_P(RasterizerSizes, LargeFootprintsHaveHolesOfTiles) {
    RasterCase scene = random_scene({12, 290, 120}, 115, 1);
    for (float& scale : scene.scales) scale *= 6;
    expect_masked(context(), scene, kRasterModes[1]);
}

TEST_P(RasterizerSizes, RefusesAMaskOfOtherTiles) {
    const RasterCase scene = random_scene({5, 37, 20}, 116, 0);
    const raster::RasterDesc desc = raster_desc(scene, kRasterModes[0]);
    const scene::Camera camera = camera_of(scene);
    auto views = need(raster::pack_views(desc, {&camera, 1}, scene.background));
    EXPECT_ERROR(raster::mask_tiles(desc, Mask(7, 1), views), Code::kInvalidArgument,
                 "a mask of 7 tiles, expected 6 (1 views of 3 x 2)");
    EXPECT_TRUE(views.active_tiles.empty());
}

}  // namespace
}  // namespace splat::test

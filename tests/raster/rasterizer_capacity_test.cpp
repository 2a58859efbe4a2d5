// A rasterizer draws fewer Gaussians and views than it was made for, with the bits of one made for
// exactly so many.
#include <gtest/gtest.h>

#include "ops/op_harness.h"
#include "raster/raster_scenes.h"
#include "raster/raster_session.h"
#include "support/gpu_buffers.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

class RasterizerCapacity : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(RasterizerCapacity);

constexpr std::uint32_t kMostViews = 3;

std::vector<scene::Camera> spread_cameras(const RasterCase& scene, std::uint32_t count) {
    std::vector<scene::Camera> cameras(count, camera_of(scene));
    for (std::uint32_t v = 1; v < count; ++v) cameras[v].world_to_camera[3] += 0.2 * v;
    return cameras;
}

/// Everything that a forward and a backward call wrote.
struct CapacityRun {
    std::vector<float> image, extra, exported, pose, gaussians, colors;
    raster::RasterStats stats;

    void expect_equal(const CapacityRun& other) const {
        EXPECT_EQ(image, other.image);
        EXPECT_EQ(extra, other.extra);
        EXPECT_EQ(exported, other.exported);
        EXPECT_EQ(pose, other.pose);
        EXPECT_EQ(gaussians, other.gaussians);
        EXPECT_EQ(colors, other.colors);
        EXPECT_EQ(stats.visible, other.stats.visible);
        EXPECT_EQ(stats.pairs, other.stats.pairs);
        EXPECT_EQ(stats.longest, other.stats.longest);
        EXPECT_EQ(stats.tiles, other.stats.tiles);
        EXPECT_EQ(stats.empty_tiles, other.stats.empty_tiles);
        EXPECT_EQ(stats.passes, other.stats.passes);
    }
};

/// Draws `scene` from `views` cameras with a rasterizer that may be larger.
CapacityRun draw_all(vk::Context& context, RasterSession& session, const gaussians::SetViews& scene,
                     std::span<const scene::Camera> cameras) {
    CapacityRun drawn;
    EXPECT_OK(session.draw(scene, cameras));
    raster::Rasterizer& rasterizer = session.rasterizer();
    const raster::RasterDesc& desc = rasterizer.drawn_desc();
    EXPECT_EQ(desc.gaussians, scene.count);
    EXPECT_EQ(desc.views, cameras.size());
    const auto packed = need(gaussians::allocate_set(context, rasterizer.desc()));
    const vk::Buffer image = upload(context, normal_fill(4 * rasterizer.desc().pixels(), 1));
    const vk::Buffer depth = upload(context, normal_fill(rasterizer.desc().pixels(), 2));
    EXPECT_OK(rasterizer.backward(image.range(), depth.range(), packed.views()));
    const raster::Workspace& space = rasterizer.workspace();
    const auto floats = [&](const vk::Buffer& buffer, std::uint64_t count) {
        return count == 0 ? std::vector<float>() : download(context, buffer.range(), count);
    };
    drawn.image = floats(space.image, 4 * desc.pixels());
    drawn.extra = floats(space.extra, 4 * desc.pixels());
    drawn.exported = floats(space.exported, 12 * desc.items());
    drawn.pose = floats(space.pose, std::uint64_t{12} * desc.views);
    drawn.gaussians = floats(packed.gaussians, std::uint64_t{12} * desc.gaussians);
    drawn.colors = floats(packed.colors, std::uint64_t{4} * desc.color_quads() * desc.gaussians);
    drawn.stats = rasterizer.stats();
    return drawn;
}

raster::RasterDesc all_gradients(const RasterCase& scene, std::uint32_t views) {
    raster::RasterDesc desc = with_gradients(raster_desc(scene, kRasterModes[2]));
    desc.extra = true;
    desc.views = views;
    return desc;
}

TEST_P(RasterizerCapacity, FewerAreDrawnAsByAnExactRasterizer) {
    const RasterCase large = random_scene({300, 45, 35}, 90, 2);
    const RasterCase small = random_scene({70, 45, 35}, 91, 2);
    RasterSession most(context(), large, all_gradients(large, kMostViews));
    ASSERT_OK(most);
    const std::vector<scene::Camera> cameras = spread_cameras(large, kMostViews);
    const CapacityRun first = draw_all(context(), most, most.scene().views(), cameras);
    for (const std::uint32_t views : {2U, 1U}) {
        SCOPED_TRACE(views);
        RasterSession exact(context(), small, all_gradients(small, views));
        ASSERT_OK(exact);
        const std::span<const scene::Camera> part(cameras.data(), views);
        const CapacityRun expected = draw_all(context(), exact, exact.scene().views(), part);
        ASSERT_GT(expected.stats.pairs, 0U);
        most.background = exact.background;
        draw_all(context(), most, exact.scene().views(), part).expect_equal(expected);
    }
    most.background = large.background;
    draw_all(context(), most, most.scene().views(), cameras).expect_equal(first);
}

TEST_P(RasterizerCapacity, NoGaussiansAndNoViews) {
    const RasterCase from = random_scene({70, 45, 35}, 91, 2);
    RasterSession session(context(), from, all_gradients(from, 2));
    ASSERT_OK(session);
    const std::vector<scene::Camera> cameras = spread_cameras(from, 2);
    const CapacityRun first = draw_all(context(), session, session.scene().views(), cameras);
    gaussians::SetViews none = session.scene().views();
    none.count = 0;
    const CapacityRun empty = draw_all(context(), session, none, cameras);
    EXPECT_EQ(empty.stats.pairs, 0U);
    EXPECT_EQ(empty.stats.empty_tiles, empty.stats.tiles);
    EXPECT_EQ(empty.pose, std::vector<float>(24));
    const CapacityRun unseen = draw_all(context(), session, session.scene().views(), {});
    EXPECT_EQ(unseen.stats.tiles, 0U);
    EXPECT_EQ(unseen.stats.visible, 0U);
    EXPECT_EQ(unseen.gaussians, std::vector<float>(unseen.gaussians.size())) << "zeros";
    EXPECT_EQ(unseen.colors, std::vector<float>(unseen.colors.size()));
    draw_all(context(), session, session.scene().views(), cameras).expect_equal(first);
}

TEST_P(RasterizerCapacity, MoreAreRefusedAndTheLastImageStays) {
    const RasterCase small = random_scene({70, 45, 35}, 91, 2);
    const RasterCase large = random_scene({71, 45, 35}, 90, 2);
    RasterSession session(context(), small, all_gradients(small, 1));
    RasterSession other(context(), large, all_gradients(large, 1));
    const std::vector<scene::Camera> cameras = spread_cameras(small, 2);
    const std::span<const scene::Camera> one(cameras.data(), 1);
    const CapacityRun first = draw_all(context(), session, session.scene().views(), one);
    EXPECT_ERROR(session.draw(other.scene().views(), one), Code::kInvalidArgument,
                 "71 Gaussians, but it was made for at most 70");
    EXPECT_ERROR(session.draw(session.scene().views(), cameras), Code::kInvalidArgument,
                 "2 cameras, expected at most 1");
    EXPECT_TRUE(session.rasterizer().drawn());
    EXPECT_EQ(session.image(), first.image);
}

}  // namespace
}  // namespace splat::test

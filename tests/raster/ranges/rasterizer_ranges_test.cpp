// Views that see ranges of a set, in one call, against a call for each range.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "ops/op_harness.h"
#include "raster/raster_scenes.h"
#include "raster/raster_session.h"
#include "support/gpu_buffers.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace ranged {

class RasterizerRanges : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(RasterizerRanges);

using Floats = std::vector<float>;
using Ranges = std::vector<raster::Range>;
using Mask = std::vector<std::uint8_t>;

/// Elements [first, first + count) of `each` numbers.
Floats part_of(const Floats& all, std::size_t first, std::size_t count, std::size_t each) {
    const auto at = all.begin() + static_cast<std::ptrdiff_t>(first * each);
    return {at, at + static_cast<std::ptrdiff_t>(count * each)};
}

RasterCase part_of(const RasterCase& all, const raster::Range& range) {
    RasterCase part = all;
    const auto cut = [&](Floats& values) {
        if (!values.empty())
            values = part_of(values, range.first, range.count, values.size() / all.count());
    };
    for (Floats* values : {&part.means, &part.scales, &part.rotations, &part.sh, &part.colors})
        cut(*values);
    cut(part.opacities);
    return part;
}

/// One call's views: ranges, cameras, gradients of the loss, and tiles that are on (empty: all).
struct Call {
    Ranges ranges;
    std::vector<scene::Camera> cameras;
    Floats grad_image, grad_depth;
    Mask mask;

    /// Some of its views, without ranges.
    [[nodiscard]] Call only(const std::vector<std::size_t>& views,
                            const raster::RasterDesc& desc) const {
        Call some;
        const std::size_t pixels = std::size_t{desc.width} * desc.height;
        const std::size_t tiles = std::size_t{desc.tiles_x()} * desc.tiles_y();
        for (const std::size_t v : views) {
            some.cameras.push_back(cameras[v]);
            const Floats image = part_of(grad_image, v, 1, 4 * pixels);
            const Floats depth = part_of(grad_depth, v, 1, pixels);
            some.grad_image.insert(some.grad_image.end(), image.begin(), image.end());
            some.grad_depth.insert(some.grad_depth.end(), depth.begin(), depth.end());
            const auto on = mask.begin() + static_cast<std::ptrdiff_t>(v * tiles);
            if (!mask.empty())
                some.mask.insert(some.mask.end(), on, on + static_cast<std::ptrdiff_t>(tiles));
        }
        return some;
    }
};

/// What forward and backward wrote, by what its numbers belong to.
struct Drawn {
    Floats image, extra, normals;             ///< [V,H,W,4]
    Floats splats, radii, exported;           ///< [items] of 12, 2, 12
    Floats pose, intrinsics;                  ///< [V] of 12, 4
    Floats gaussians, colors, contributions;  ///< [N] of 12, 4 color_quads, 2
    raster::RasterStats stats;
};

Drawn draw(vk::Context& context, RasterSession& session, const Call& call) {
    raster::Rasterizer& rasterizer = session.rasterizer();
    const gaussians::SetViews scene = session.scene().views();
    auto views = need(raster::pack_views(rasterizer.desc(), call.cameras, session.background));
    if (!call.mask.empty()) {
        EXPECT_OK(raster::mask_tiles(rasterizer.desc(), call.mask, views));
    }
    if (!call.ranges.empty()) {
        EXPECT_OK(raster::see_ranges(context.device().info(), rasterizer.desc(), scene.count,
                                     call.ranges, views));
    }
    EXPECT_OK(rasterizer.forward(scene, views));
    EXPECT_OK(session.backward(call.grad_image, call.grad_depth));
    const raster::RasterDesc& desc = rasterizer.drawn_desc();
    const raster::Workspace& space = rasterizer.workspace();
    const auto read = [&](const vk::Buffer& from, std::uint64_t count) {
        return count > 0 ? download(context, from.range(), count) : Floats();
    };
    Drawn drawn;
    drawn.image = read(space.image, 4 * desc.pixels());
    drawn.extra = read(space.extra, 4 * desc.pixels());
    drawn.normals = read(space.normal_image, 4 * desc.pixels());
    drawn.splats = read(space.splats, 12 * desc.items());
    drawn.radii = read(space.radii, 2 * desc.items());
    drawn.exported = read(space.exported, 12 * desc.items());
    drawn.pose = read(space.pose, std::uint64_t{12} * desc.views);
    drawn.intrinsics = read(space.intrinsics, std::uint64_t{4} * desc.views);
    drawn.contributions = read(space.contributions, std::uint64_t{2} * desc.gaussians);
    const Floats set = session.gradients();
    drawn.gaussians = part_of(set, 0, scene.count, 12);
    drawn.colors = Floats(set.begin() + static_cast<std::ptrdiff_t>(12 * scene.count), set.end());
    drawn.stats = rasterizer.stats();
    return drawn;
}

/// Adds the results of a range to those of the set; the first that has a Gaussian sets them.
void add(Floats& to, const Floats& from, const raster::Range& range, const Mask& seen) {
    if (range.count == 0) return;
    const std::size_t each = from.size() / range.count;
    for (std::size_t i = 0; i < from.size(); ++i) {
        float& at = to[range.first * each + i];
        at = seen[range.first + i / each] != 0 ? at + from[i] : from[i];
    }
}

/// Checks a view of the batched call against the same of a call for its range.
void expect_view(const Drawn& all, std::size_t v, std::size_t item, const Drawn& one, std::size_t w,
                 const raster::Range& range, std::size_t pixels) {
    SCOPED_TRACE(v);
    const auto same = [&](const Floats Drawn::*values, std::size_t each) {
        EXPECT_EQ(part_of(all.*values, v, 1, each), part_of(one.*values, w, 1, each));
    };
    same(&Drawn::image, 4 * pixels);
    same(&Drawn::normals, 4 * pixels);
    same(&Drawn::pose, 12);
    same(&Drawn::intrinsics, 4);
    Floats extra = part_of(one.extra, w, 1, 4 * pixels);
    for (std::size_t p = 3; p < extra.size(); p += 4)
        if (extra[p] >= 0) extra[p] += static_cast<float>(range.first);
    EXPECT_EQ(part_of(all.extra, v, 1, 4 * pixels), extra);
    const auto same_items = [&](const Floats Drawn::*values, std::size_t each) {
        EXPECT_EQ(part_of(all.*values, item, range.count, each),
                  part_of(one.*values, w * range.count, range.count, each));
    };
    same_items(&Drawn::splats, 12);
    same_items(&Drawn::radii, 2);
    same_items(&Drawn::exported, 12);
}

/// A description for all gradients of so many views, and a case's cameras: each turned a little.
struct Batch {
    RasterCase scene;
    raster::RasterDesc desc;
    Call call;

    Batch(const RasterCase& from, const RasterMode& mode, const Ranges& ranges)
        : scene(from), desc(with_gradients(raster_desc(from, mode))) {
        desc.ids = true;
        desc.views = static_cast<std::uint32_t>(ranges.size());
        desc.most_items = 0;
        for (const raster::Range& range : ranges) desc.most_items += range.count;
        call.ranges = ranges;
        for (std::size_t v = 0; v < ranges.size(); ++v) {
            call.cameras.push_back(camera_of(scene));
            call.cameras.back().world_to_camera[3] += 0.05 * static_cast<double>(v);
        }
        call.grad_image = normal_fill(4 * desc.pixels(), 1);
        call.grad_depth = normal_fill(desc.pixels(), 2);
    }
};

/// Draws all in one call, and each range in one of its own. Returns the first.
Drawn expect_as_many_calls(vk::Context& context, const Batch& setup) {
    const raster::RasterDesc& desc = setup.desc;
    RasterSession session(context, setup.scene, desc);
    EXPECT_OK(session);
    const Drawn all = draw(context, session, setup.call);
    std::vector<std::size_t> items(1, 0);
    std::vector<Ranges::value_type> distinct;
    for (const raster::Range& range : setup.call.ranges) {
        items.push_back(items.back() + range.count);
        if (std::ranges::find(distinct, range) == distinct.end()) distinct.push_back(range);
    }
    const std::size_t n = setup.scene.count();
    Mask seen(n);
    Floats gaussians(12 * n), colors(4 * std::size_t{desc.color_quads()} * n), contributions(2 * n);
    std::uint64_t pairs = 0;
    for (const raster::Range& range : distinct) {
        std::vector<std::size_t> views;
        for (std::size_t v = 0; v < setup.call.ranges.size(); ++v)
            if (setup.call.ranges[v] == range) views.push_back(v);
        raster::RasterDesc alone = desc;
        alone.gaussians = range.count;
        alone.views = static_cast<std::uint32_t>(views.size());
        alone.most_items = ~std::uint64_t{0};
        RasterSession exact(context, part_of(setup.scene, range), alone);
        EXPECT_OK(exact);
        const Drawn one = draw(context, exact, setup.call.only(views, desc));
        for (std::size_t w = 0; w < views.size(); ++w)
            expect_view(all, views[w], items[views[w]], one, w, range, setup.scene.pixels());
        add(gaussians, one.gaussians, range, seen);
        add(colors, one.colors, range, seen);
        add(contributions, one.contributions, range, seen);
        std::fill_n(seen.begin() + range.first, range.count, 1);
        pairs += one.stats.pairs;
    }
    EXPECT_EQ(all.gaussians, gaussians);
    EXPECT_EQ(all.colors, colors);
    EXPECT_EQ(all.contributions, contributions);
    EXPECT_EQ(all.stats.pairs, pairs);
    EXPECT_EQ(all.stats.visible + all.stats.culled, items.back());
    return all;
}

/// Sizes that are no multiples of a workgroup, in any order; not all Gaussians are seen.
const Ranges kObjects = {{131, 70}, {0, 1}, {1, 130}, {131, 70}, {0, 1}, {205, 64}, {1, 130}};
/// Overlaps of all kinds, the whole set, and ranges without Gaussians, two of them at its ends.
const Ranges kOverlaps = {{0, 0},   {20, 100}, {70, 100}, {20, 100}, {60, 0},
                          {0, 180}, {100, 1},  {180, 0},  {75, 33}};

TEST_P(RasterizerRanges, AreAsManyCalls) {
    expect_as_many_calls(context(),
                         {random_scene({270, 40, 33}, 130, 1), kRasterModes[0], kObjects});
    expect_as_many_calls(context(),
                         {random_scene({270, 40, 33}, 131, 3), kRasterModes[2], kObjects});
}

TEST_P(RasterizerRanges, OverlapAndAreEmpty) {
    expect_as_many_calls(context(),
                         {random_scene({180, 40, 33}, 132, 1), kRasterModes[1], kOverlaps});
    expect_as_many_calls(context(),
                         {random_scene({180, 40, 33}, 133, 0), kRasterModes[0], {{33, 90}}});
    const Drawn none = expect_as_many_calls(
        context(), {random_scene({18, 20, 33}, 134, 1), kRasterModes[1], {{0, 0}, {18, 0}}});
    EXPECT_EQ(none.stats.pairs, 0U);
}

TEST_P(RasterizerRanges, HaveLargeFootprintsSmallerViewsAndTilesThatAreOff) {
    RasterCase scene = random_scene({30, 290, 120}, 135, 1);
    for (float& scale : scene.scales) scale *= 6;
    const Ranges ranges = {{20, 10}, {0, 12}, {0, 0}, {12, 8}, {0, 12}};
    expect_as_many_calls(context(), {scene, kRasterModes[1], ranges});
    Batch masked(scene, kRasterModes[0], ranges);
    for (scene::Camera& camera : masked.call.cameras) camera.width -= 19;
    const std::size_t tiles = std::size_t{masked.desc.tiles_x()} * masked.desc.tiles_y();
    for (const float noise : normal_fill(ranges.size() * tiles, 3))
        masked.call.mask.push_back(noise > 0 ? 1 : 0);
    expect_as_many_calls(context(), masked);
}

/// Slices of 256 Gaussians cut workgroups, whose sums of poses would change.
TEST_P(RasterizerRanges, SlicesGiveTheSameBits) {
    RasterCase scene = random_scene({700, 40, 33}, 136, 3);
    for (float& scale : scene.scales) scale *= 0.2F;
    const Batch setup(scene, kRasterModes[1], {{10, 600}, {650, 50}, {190, 130}});
    vk::ContextDesc lowered = context_desc(GetParam());
    lowered.device.fake = [](vk::DeviceInfo& info) {
        info.limits.max_storage_buffer_bytes = 511 * 12 * 16;
    };
    const auto narrow = make_context(lowered);
    ASSERT_EQ(raster::slice_size(narrow->device().info(), GetParam(), setup.desc), 256U);
    RasterSession whole(context(), setup.scene, setup.desc),
        slices(*narrow, setup.scene, setup.desc);
    ASSERT_OK(whole);
    ASSERT_OK(slices);
    const Drawn a = draw(context(), whole, setup.call), b = draw(*narrow, slices, setup.call);
    ASSERT_EQ(b.stats.passes, 1U) << "gradients are added in another order";
    EXPECT_GT(a.stats.pairs, 700U);
    EXPECT_EQ(a.image, b.image);
    EXPECT_EQ(a.exported, b.exported);
    EXPECT_EQ(a.pose, b.pose);
    EXPECT_EQ(a.gaussians, b.gaussians);
    EXPECT_EQ(a.colors, b.colors);
    EXPECT_EQ(a.contributions, b.contributions);
}

TEST_P(RasterizerRanges, ChangeFromCallToCall) {
    const RasterCase scene = random_scene({90, 40, 33}, 137, 1);
    Batch setup(scene, kRasterModes[1], {{0, 40}, {40, 50}});
    setup.desc.most_items = 180;
    RasterSession session(context(), scene, setup.desc);
    ASSERT_OK(session);
    Call whole = setup.call, other = setup.call;
    whole.ranges.clear();
    other.ranges = {{5, 40}, {30, 50}};  // the same numbers of items and workgroups
    const Drawn first = draw(context(), session, setup.call);
    const Drawn all = draw(context(), session, whole);
    const Drawn moved = draw(context(), session, other);
    EXPECT_NE(first.image, all.image);
    EXPECT_NE(first.image, moved.image);
    const Drawn again = draw(context(), session, setup.call),
                back = draw(context(), session, whole);
    EXPECT_EQ(again.image, first.image);
    EXPECT_EQ(again.gaussians, first.gaussians);
    EXPECT_EQ(again.pose, first.pose);
    EXPECT_EQ(back.image, all.image);
    EXPECT_EQ(back.gaussians, all.gaussians);
    RasterSession fresh(context(), scene, setup.desc);
    ASSERT_OK(fresh);
    const Drawn exact = draw(context(), fresh, other);
    EXPECT_EQ(moved.image, exact.image);
    EXPECT_EQ(moved.gaussians, exact.gaussians);
    EXPECT_EQ(moved.contributions, exact.contributions);
}

TEST_P(RasterizerRanges, AreDrawnAnewOnlyIfTheyChange) {
    const RasterCase scene = random_scene({90, 40, 33}, 138, 1);
    const Batch setup(scene, kRasterModes[1], {{0, 40}, {40, 50}});
    RasterSession session(context(), scene, setup.desc);
    ASSERT_OK(session);
    gaussians::SetViews set = session.scene().views();
    set.version = 7;
    const auto runs = [&](const Ranges& ranges) {
        auto views = need(raster::pack_views(setup.desc, setup.call.cameras, session.background));
        EXPECT_OK(raster::see_ranges(context().device().info(), setup.desc, 90, ranges, views));
        EXPECT_OK(session.rasterizer().forward(set, views));
        return session.rasterizer().stats().runs;
    };
    EXPECT_EQ(runs(setup.call.ranges), 1U);
    EXPECT_EQ(runs(setup.call.ranges), 0U);
    EXPECT_EQ(runs({{1, 40}, {40, 50}}), 1U);
    EXPECT_EQ(runs(setup.call.ranges), 1U);
}

/// Eight objects of six views take the memory of eight rasterizers, not that of all objects in all views.
TEST_P(RasterizerRanges, TakeTheMemoryOfAsManyCalls) {
    const RasterCase scene = random_scene({8 * 500, 40, 33}, 139, 1);
    Ranges ranges;
    for (std::uint32_t v = 0; v < 48; ++v) ranges.push_back({v / 6 * 500, 500});
    const Batch setup(scene, kRasterModes[1], ranges);
    RasterSession batched(context(), scene, setup.desc);
    raster::RasterDesc one = setup.desc;
    one.gaussians = 500;
    one.views = 6;
    one.most_items = ~std::uint64_t{0};
    RasterSession alone(context(), part_of(scene, {0, 500}), one);
    ASSERT_OK(batched);
    ASSERT_OK(alone);
    const std::uint64_t bytes = batched.rasterizer().workspace().bytes();
    EXPECT_LT(bytes, 17 * alone.rasterizer().workspace().bytes() / 2);
    EXPECT_GT(bytes, 7 * alone.rasterizer().workspace().bytes());
}

TEST_P(RasterizerRanges, BadOnesAreRefused) {
    const RasterCase scene = random_scene({20, 24, 20}, 140, 0);
    const Batch setup(scene, kRasterModes[0], {{0, 12}, {5, 15}});
    const auto views = need(raster::pack_views(setup.desc, setup.call.cameras, scene.background));
    const auto see = [&](const Ranges& ranges) {
        auto copy = views;
        const Status status =
            raster::see_ranges(context().device().info(), setup.desc, 20, ranges, copy);
        EXPECT_EQ(copy == views, !status.ok());
        return status;
    };
    EXPECT_ERROR(see({{0, 12}}), Code::kInvalidArgument, "ranges of 1 views, expected 2");
    EXPECT_ERROR(see({{0, 12}, {6, 15}}), Code::kInvalidArgument,
                 "view 1 sees Gaussians 6 to 21, but there are 20");
    EXPECT_ERROR(see({{0xFFFFFFFF, 0xFFFFFFFF}, {0, 1}}), Code::kInvalidArgument,
                 "view 0 sees Gaussians 4294967295 to 8589934590, but there are 20");
    EXPECT_ERROR(see({{0, 13}, {5, 15}}), Code::kInvalidArgument,
                 "the ranges of views 0 to 1 hold 28 Gaussians, but it was made for 27");
    EXPECT_OK(see({{20, 0}, {0, 20}}));
    RasterSession session(context(), scene, setup.desc);
    ASSERT_OK(session);
    EXPECT_ERROR(session.forward(), Code::kInvalidArgument,
                 "20 Gaussians in 2 views, but it was made for at most 27 items");
}

}  // namespace ranged
}  // namespace splat::test

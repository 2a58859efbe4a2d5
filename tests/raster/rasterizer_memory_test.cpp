// More pairs than the arrays hold, more pairs than a binding holds, and lists longer than loops have turns.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <span>

#include "core/checked_math.h"
#include "ops/op_harness.h"
#include "raster/raster_scenes.h"
#include "raster/raster_session.h"
#include "raster/tile_bin.h"
#include "support/gpu_buffers.h"
#include "support/log_capture.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

class RasterizerMemory : public KernelsTest {
  protected:
    /// A device with the same kernels and small bindings.
    [[nodiscard]] std::shared_ptr<vk::Context> lowered(std::uint64_t binding_bytes) const {
        vk::ContextDesc desc = context_desc(GetParam());
        desc.device.fake = [binding_bytes](vk::DeviceInfo& info) {
            info.limits.max_storage_buffer_bytes = binding_bytes;
        };
        return make_context(desc);
    }

    /// Bytes of a record in one binding.
    [[nodiscard]] static std::uint64_t record_bytes() {
        return GetParam() == vk::Kernels::kCpu ? 16 : 48;
    }

    /// A device with the same kernels and this much memory in all (0: no limit). Each buffer has a
    /// block of its own, so that the sum is exact.
    [[nodiscard]] std::shared_ptr<vk::Context> limited(std::uint64_t budget_bytes) const {
        vk::ContextDesc desc = context_desc(GetParam(), Bounds::kExact);
        desc.memory.budget_bytes = budget_bytes;
        return make_context(desc);
    }
};
SPLAT_INSTANTIATE_KERNELS(RasterizerMemory);

/// Each Gaussian reaches every tile faintly, except every sixth, which reaches few.
RasterCase wide_faint_scene(const SceneSize& size) {
    RasterCase scene = random_scene(size, 70, 0);
    Rng rng(71);
    for (std::size_t i = 0; i < scene.scales.size(); ++i)
        scene.scales[i] = static_cast<float>(i / 3 % 6 == 5 ? 0.03 : 3 + rng.uniform());
    for (float& opacity : scene.opacities)
        opacity = static_cast<float>(0.01 + 0.02 * rng.uniform());
    scene.name = "wide and faint";
    return scene;
}

struct Drawn {
    Status status;
    std::vector<float> image, gaussians, exported;
    raster::RasterStats stats;
};

/// One forward and backward call, always with the same loss weights.
Drawn draw(vk::Context& context, const RasterCase& scene, raster::RasterDesc desc,
           bool backward = true) {
    if (backward) desc = with_gradients(desc);
    RasterSession session(context, scene, desc);
    Drawn drawn;
    const auto all = [&]() -> Status {
        SPLAT_TRY(session.status());
        SPLAT_TRY(session.forward());
        drawn.stats = session.rasterizer().stats();
        const auto pixels = static_cast<std::size_t>(desc.pixels());
        drawn.image = session.image();
        if (!backward) return {};
        SPLAT_TRY(session.backward(normal_fill(4 * pixels, 1), normal_fill(pixels, 2)));
        drawn.gaussians = session.gradients();
        drawn.exported = session.exported();
        return {};
    };
    drawn.status = all();
    return drawn;
}

/// The first arrays hold 4096 pairs, or 4 per Gaussian; this scene has 100 x 48. With 1400 more,
/// invisible Gaussians the first arrays hold them all.
void expect_same_after_growth(vk::Context& context, const RasterMode& mode, bool backward) {
    const RasterCase scene = wide_faint_scene({120, 120, 90});
    RasterCase roomy = scene;
    const RasterCase hidden = random_scene({1400, 120, 90}, 72, 0);
    roomy.opacities.resize(scene.count() + hidden.count(), 0.0F);
    for (auto tensor :
         {&RasterCase::means, &RasterCase::scales, &RasterCase::rotations, &RasterCase::sh})
        (roomy.*tensor)
            .insert((roomy.*tensor).end(), (hidden.*tensor).begin(), (hidden.*tensor).end());
    const Drawn grown = draw(context, scene, raster_desc(scene, mode), backward);
    const Drawn at_once = draw(context, roomy, raster_desc(roomy, mode), backward);
    ASSERT_OK(grown.status);
    ASSERT_OK(at_once.status);
    EXPECT_EQ(grown.stats.runs, 2U);
    EXPECT_EQ(at_once.stats.runs, 1U);
    EXPECT_EQ(grown.stats.pairs, at_once.stats.pairs);
    EXPECT_GT(grown.stats.pairs, 4096U);
    EXPECT_EQ(grown.image, at_once.image);
    for (std::size_t i = 0; backward && i < 12 * scene.count(); ++i)
        ASSERT_EQ(grown.gaussians[i], at_once.gaussians[i]) << i;
}

TEST_P(RasterizerMemory, GrowsToTheSameBits) {
    const bool cpu = GetParam() == vk::Kernels::kCpu;  // other kernels take seconds
    expect_same_after_growth(context(), kRasterModes[1], cpu);
}

TEST_P(RasterizerMemory, GrowsOnce) {
    const RasterCase scene = wide_faint_scene({120, 120, 90});
    RasterSession session(context(), scene, raster_desc(scene, kRasterModes[0]));
    ASSERT_OK(session);
    ASSERT_OK(session.forward());
    EXPECT_EQ(session.rasterizer().stats().runs, 2U);
    const std::vector<float> image = session.image();
    ASSERT_OK(session.forward());
    EXPECT_EQ(session.rasterizer().stats().runs, 1U);
    EXPECT_EQ(session.image(), image);
}

/// Growing frees the old arrays before it allocates the larger ones, with room for more pairs where there is memory for
/// that. Without memory for them every call fails, and the rasterizer still draws scenes that need no growth.
TEST_P(RasterizerMemory, GrowthPastTheBudgetLeavesItUsable) {
    const RasterCase scene = wide_faint_scene({120, 120, 90});
    RasterCase narrow = scene;
    for (float& scale : narrow.scales) scale *= 0.01F;
    raster::RasterDesc desc = raster_desc(scene, kRasterModes[0]);
    desc.backward = true;
    const std::vector<float> expected = raster_image(context(), narrow, desc);
    std::uint64_t before = 0;
    std::uint64_t after = 0;
    std::vector<float> wide;
    for (const int quarters : {4, 2, 1}) {  // growth takes that of 4096 to 6000 pairs
        const bool enough = quarters > 1;
        const auto device = limited(quarters == 4 ? 0 : before + (after - before) / 4 * quarters);
        const LogCapture log(LogLevel::kInfo);
        const auto other = need(PackedCase::create(*device, narrow, desc));
        RasterSession session(*device, scene, desc);
        ASSERT_OK(session);
        before = device->memory().use().used;
        if (enough) {
            ASSERT_OK(session.forward());
            EXPECT_EQ(session.rasterizer().stats().runs, 2U);
            const std::uint64_t grown = device->memory().use().used;
            EXPECT_EQ(device->memory().use().peak, grown) << "old and new ones at once";
            EXPECT_EQ(log.text().find("pairs get no room to grow: ") != std::string::npos,
                      quarters == 2)
                << log.text();
            if (quarters == 4) {
                after = grown;
                wide = session.image();
            }
            EXPECT_EQ(session.image(), wide);
        } else {
            for (int call = 0; call < 2; ++call)
                EXPECT_ERROR(session.forward(), Code::kOutOfDeviceMemory, "of the budget of");
            EXPECT_ERROR(session.backward(std::vector<float>(4 * scene.pixels())),
                         Code::kInvalidArgument, "needs a forward call");
        }
        const scene::Camera camera = camera_of(scene);
        ASSERT_OK(session.draw(other.scene.views(), {&camera, 1}));
        EXPECT_EQ(session.image(), expected) << quarters;
    }
}

/// Bindings of one record per pixel hold 256 pairs per tile.
void expect_same_in_groups(vk::Context& whole_device, vk::Context& narrow, const RasterCase& scene,
                           const RasterMode& mode, std::uint32_t least_passes,
                           bool backward = true) {
    raster::RasterDesc desc = raster_desc(scene, mode);
    desc.backward = true;  // for the size of the arrays
    const Drawn whole = draw(whole_device, scene, desc, backward);
    const Drawn groups = draw(narrow, scene, desc, backward);
    ASSERT_OK(whole.status);
    ASSERT_OK(groups.status);
    EXPECT_EQ(whole.stats.passes, 1U);
    EXPECT_GE(groups.stats.passes, least_passes);
    EXPECT_EQ(groups.stats.pairs, whole.stats.pairs);
    EXPECT_LE(groups.stats.visible, whole.stats.visible);
    EXPECT_EQ(groups.stats.longest, whole.stats.longest);
    EXPECT_EQ(groups.image, whole.image);
    if (!backward) return;
    // Sums over 12 tiles in another order; the projection then cancels part of them.
    const double difference = relative_difference(groups.gaussians, whole.gaussians);
    const double exported = relative_difference(groups.exported, whole.exported);
    std::printf("%u passes: gradients differ by %.1e, exported ones by %.1e\n", groups.stats.passes,
                difference, exported);
    EXPECT_LE(difference, 5e-6);
    EXPECT_LE(exported, 5e-6);
}

TEST_P(RasterizerMemory, GroupsOfTileRowsGiveTheSameImage) {
    const RasterCase scene = wide_faint_scene({360, 32, 96});
    const auto narrow = lowered(record_bytes() * scene.pixels());
    const bool cpu =
        GetParam() == vk::Kernels::kCpu;  // the gradient takes seconds with other kernels
    expect_same_in_groups(context(), *narrow, scene, kRasterModes[0], 2, cpu);
}

/// A scene that needs groups of rows leaves no groups to one of as many Gaussians that needs none.
TEST_P(RasterizerMemory, PassesDoNotDependOnEarlierScenes) {
    const RasterCase wide = wide_faint_scene({360, 32, 96});
    RasterCase few = wide;
    for (float& scale : few.scales) scale *= 0.1F;
    const auto narrow = lowered(record_bytes() * wide.pixels());
    const raster::RasterDesc desc = with_gradients(raster_desc(wide, kRasterModes[0]));
    const std::vector<float> weights = normal_fill(4 * wide.pixels(), 1);
    RasterSession fresh(*narrow, few, desc);
    ASSERT_OK(fresh.forward());
    ASSERT_OK(fresh.backward(weights));
    RasterSession used(*narrow, wide, desc);
    ASSERT_OK(used.forward());
    const std::uint32_t groups = used.rasterizer().stats().passes;
    ASSERT_GE(groups, 2U);
    const std::vector<float> image = used.image();
    const scene::Camera camera = camera_of(few);
    ASSERT_OK(used.draw(fresh.scene().views(), {&camera, 1}));
    EXPECT_EQ(used.rasterizer().stats().passes, 1U);
    EXPECT_EQ(used.image(), fresh.image());
    ASSERT_OK(used.backward(weights));
    EXPECT_EQ(used.gradients(), fresh.gradients());
    ASSERT_OK(used.forward());
    EXPECT_EQ(used.rasterizer().stats().passes, groups);
    EXPECT_EQ(used.image(), image);
}

/// For each Gaussian mean, opacity, depth, conic factor, reach; then all radii.
std::vector<float> of_gaussians(vk::Context& context, RasterSession& session, std::size_t count) {
    const raster::Workspace& space = session.rasterizer().workspace();
    const std::vector<float> splats = download(context, space.splats.range(), 12 * count);
    std::vector<float> all = download(context, space.radii.range(), 2 * count);
    for (std::size_t i = 0; i < splats.size(); ++i)
        if (i % 12 < 8) all.push_back(splats[i]);
    return all;
}

/// Every fourth colour is not finite, also of Gaussians that reach few or no rows of tiles.
TEST_P(RasterizerMemory, OutputsOfAGaussianDependOnNoWindowOrSkip) {
    RasterCase scene = wide_faint_scene({480, 32, 96});
    for (std::size_t i = 1; i < scene.count(); i += 4)
        scene.sh[3 * i + i % 3] = std::numeric_limits<float>::quiet_NaN();
    for (std::size_t i = 1; i < scene.count(); i += 8) scene.opacities[i] *= 0.2F;
    for (const std::size_t i : {17, 65, 29, 77}) scene.scales[3 * i] = 1e-4F;
    const auto narrow = lowered(record_bytes() * scene.pixels());
    for (const RasterMode& mode : std::span(kRasterModes).first(2)) {
        SCOPED_TRACE(mode.name);
        raster::RasterDesc desc = raster_desc(scene, mode);
        desc.backward = true;  // for the size of the arrays
        RasterSession whole(context(), scene, desc);
        ASSERT_OK(whole.forward());
        const std::vector<float> expected = of_gaussians(context(), whole, scene.count());
        const auto seen = std::count_if(expected.begin(), expected.begin() + 2 * 480,
                                        [](float radius) { return radius > 0; });
        EXPECT_GT(seen, 2 * 340) << "those of finite colours";
        EXPECT_LT(seen, 2 * 430) << "not those of other colours, except the faint ones of 3dgs";
        RasterSession groups(*narrow, scene, desc);
        ASSERT_OK(groups.forward());
        EXPECT_GE(groups.rasterizer().stats().passes, 2U);
        EXPECT_EQ(of_gaussians(*narrow, groups, scene.count()), expected);
        desc.skips = {false, false, false, false, false, false};
        RasterSession without(context(), scene, desc);
        ASSERT_OK(without.forward());
        EXPECT_EQ(of_gaussians(context(), without, scene.count()), expected) << "no skips";
        EXPECT_EQ(without.image(), whole.image());
    }
}

/// 1100 Gaussians, most of them in 4 tiles of a row; room for 3300 pairs or, with other kernels than
/// those for CPUs, 1100.
TEST_P(RasterizerMemory, RefusesRowsThatNoBindingHolds) {
    const RasterCase scene = wide_faint_scene({1100, 64, 48});
    const auto narrow = lowered(std::uint64_t{50} * 1100);  // room for sums of poses, too
    RasterSession session(*narrow, scene, with_gradients(raster_desc(scene, kRasterModes[0])));
    ASSERT_OK(session);
    EXPECT_ERROR(session.forward(), Code::kUnsupported, "with one row of tiles");
    EXPECT_ERROR(session.backward(std::vector<float>(4 * scene.pixels())), Code::kInvalidArgument,
                 "needs a forward call");
}

/// Two Gaussians that the middle pixel sees, and between them `count` that no pixel sees though
/// they reach the tile: opacity 0.005, points on the border between two pixels. Their list ends
/// late, and the image and the gradient are those of the two alone, bit by bit.
RasterCase long_list(std::size_t count) {
    RasterCase scene = empty_scene({0, 16, 16});
    scene.name = "list of " + std::to_string(count);
    scene.camera.world_to_camera = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    scene.camera.fx = scene.camera.fy = 16;
    scene.camera.cx = scene.camera.cy = 8;
    const auto add = [&](float pixel_x, float pixel_y, float z, float scale, float opacity) {
        scene.means.insert(scene.means.end(), {(pixel_x - 8) / 16 * z, (pixel_y - 8) / 16 * z, z});
        scene.scales.insert(scene.scales.end(), 3, scale);
        scene.rotations.insert(scene.rotations.end(), {1, 0, 0, 0});
        scene.opacities.push_back(opacity);
        for (std::size_t k = 0; k < 3; ++k) scene.sh.push_back(z == 2 ? 0.7F : -0.4F);
    };
    add(8.4F, 8.3F, 2, 0.2F, 0.6F);
    for (std::size_t i = 0; i < count; ++i)
        add(static_cast<float>(i % 16) + 0.5F, static_cast<float>(1 + i / 16 % 15), 4, 0, 0.005F);
    add(7.8F, 8.1F, 8, 0.9F, 0.7F);
    return scene;
}

/// Lists are right to the last entry.
void expect_right(vk::Context& context, std::size_t count, bool backward, bool blocks = true) {
    const RasterCase scene = long_list(count);
    const RasterCase two = long_list(0);
    raster::RasterDesc desc = raster_desc(scene, kRasterModes[1]);
    desc.skips.blocks = blocks;
    desc.backward = backward;
    RasterSession session(context, scene, desc);
    ASSERT_OK(session);
    ASSERT_OK(session.forward());
    EXPECT_EQ(session.rasterizer().stats().longest, count + 2);
    desc.gaussians = 2;
    RasterSession alone(context, two, desc);
    ASSERT_OK(alone.forward());
    EXPECT_EQ(session.image(), alone.image()) << count << " entries, blocks " << blocks;
    if (!backward) return;
    const std::vector<float> weights = normal_fill(4 * two.pixels(), 5);
    ASSERT_OK(session.backward(weights));
    ASSERT_OK(alone.backward(weights));
    const std::vector<float> got = session.gradients();
    const std::vector<float> expected = alone.gradients();
    for (std::size_t k = 0; k < 12; ++k) {
        EXPECT_EQ(got[k], expected[k]) << count << " entries, the first's " << k;
        EXPECT_EQ(got[12 * (count + 1) + k], expected[12 + k]) << count << ", the last's " << k;
    }
}

/// Entries that loops on lavapipe reach without parts, as measured.
std::uint64_t longest_without_parts(vk::Kernels kernels, bool backward) {
    if (kernels == vk::Kernels::kCpu) return backward ? 52000 : 174000;
    return backward && kernels == vk::Kernels::kGpu ? 1900 : 63000;
}

/// Lengths around what one loop reaches with kernels for GPUs on a CPU device; lists have two entries more than
/// `count`.
/// For longer lists with other kernels see VeryLongListsAreRight.
TEST_P(RasterizerMemory, LongListsAreRight) {
    for (const std::size_t count : {1898, 1899, 2298, 2400}) expect_right(context(), count, true);
}

/// Entries that reach every block and are walked to the end take the most turns that a walk can, and give the same bits
/// whether a test of blocks leaves out entries or not. If the loop ended early, the first entries would have no
/// gradient.
void expect_same_by_blocks(vk::Context& context, std::size_t count) {
    RasterCase scene = wide_faint_scene({count, 16, 16});
    scene.opacities.assign(scene.count(), 0.006F);
    scene.scales.assign(3 * scene.count(), 5);
    raster::RasterDesc desc = raster_desc(scene, kRasterModes[1]);
    desc.skips.early_out = false;
    const Drawn with = draw(context, scene, desc);
    desc.skips.blocks = false;
    const Drawn without = draw(context, scene, desc);
    ASSERT_OK(with.status);
    ASSERT_OK(without.status);
    EXPECT_EQ(with.stats.longest, count);
    EXPECT_EQ(with.gaussians, without.gaussians) << count;
    EXPECT_EQ(with.exported, without.exported) << count;
    const auto moved = std::count_if(with.gaussians.begin(), with.gaussians.end(),
                                     [](float value) { return value != 0; });
    EXPECT_GT(moved, 5) << "the list says nothing";
}

/// Only the kernels for CPU devices can walk blocks.
class RasterizerMemoryCpu : public RasterizerMemory {};
INSTANTIATE_TEST_SUITE_P(Kernels, RasterizerMemoryCpu, testing::Values(vk::Kernels::kCpu),
                         kernels_test_name);

TEST_P(RasterizerMemoryCpu, TestsOfBlocksChangeNoBit) {
    for (const std::size_t count : {1, 13, 500, 15871, 15872, 15873, 16000})
        expect_same_by_blocks(context(), count);
}

/// Turns of chunks of binning: 8 lanes that walk their entries take a turn for the sums of 16 chunks, one
/// for 8 entries and one for each of the 90 tiles of the largest packed footprint, then another if
/// some are not packed; one lane takes one for each entry.
TEST_P(RasterizerMemory, ChunksOfBinningFitTheTurnsOfLoops) {
    const vk::Recorder recorder(context());
    raster::RasterDesc desc;
    desc.views = 1;
    for (const std::uint32_t items : {1U, 2826240U, 2826241U, 5000000U, 100000000U, 1U << 27}) {
        desc.gaussians = items;
        const std::uint32_t lanes = raster::tile_bin_lanes(recorder, desc);
        EXPECT_LE(lanes, 65535U) << "workgroups of a dispatch, and turns of the scan; " << items;
        const std::uint64_t chunk = ceil_div(std::uint64_t{items}, lanes);
        const std::uint64_t turns =
            GetParam() == vk::Kernels::kCpu ? lanes / 16 + ceil_div(chunk, 8) * 92 : chunk;
        EXPECT_LE(turns, 65535U) << items;
    }
}

class RasterizerMemoryFull : public RasterizerMemory {};
SPLAT_INSTANTIATE_KERNELS(RasterizerMemoryFull);

TEST_P(RasterizerMemoryFull, GrowsToTheSameBits) {
    for (const RasterMode& mode : kRasterModes) expect_same_after_growth(context(), mode, true);
}

TEST_P(RasterizerMemoryFull, GroupsOfTileRowsGiveTheSameImage) {
    for (const std::size_t count : {360, 1000}) {
        const RasterCase scene = wide_faint_scene({count, 32, 96});
        const auto narrow = lowered(record_bytes() * scene.pixels());
        for (const RasterMode& mode : kRasterModes) {
            SCOPED_TRACE(mode.name);
            expect_same_in_groups(context(), *narrow, scene, mode, count == 360 ? 2 : 5);
        }
    }
}

TEST_P(RasterizerMemoryFull, VeryLongListsAreRight) {
    for (const bool backward : {false, true}) {
        const std::uint64_t least = longest_without_parts(GetParam(), backward);
        for (const bool blocks : {true, false}) {
            if (!blocks && GetParam() != vk::Kernels::kCpu)
                continue;  // other kernels only walk tiles
            for (const std::uint64_t count :
                 {least / 2, least - 9, least - 2, least - 1, least + 1000, least * 4})
                expect_right(context(), count, backward, blocks);
        }
    }
}

/// Minutes of work for all kernels but those for CPUs.
TEST_P(RasterizerMemoryFull, AMillionEntriesAreRight) {
    expect_right(context(), 999'998, true);
}

/// 4000 Gaussians each reach all of 1200 tiles, shared by few invocations. The last tile must have
/// its whole list: its pixels equal those of a camera that sees only this tile.
TEST_P(RasterizerMemoryFull, ManyLargeGaussiansReachEveryTile) {
    RasterCase scene = wide_faint_scene({4000, 640, 480});
    scene.opacities.assign(scene.count(), 0.006F);
    for (float& scale : scene.scales) scale = 9;
    raster::RasterDesc desc = raster_desc(scene, kRasterModes[1]);
    RasterSession session(context(), scene, desc);
    ASSERT_OK(session);
    ASSERT_OK(session.forward());
    const raster::RasterStats& stats = session.rasterizer().stats();
    EXPECT_EQ(stats.longest, scene.count());
    EXPECT_EQ(stats.pairs, stats.tiles * scene.count());
    const std::vector<float> whole = session.image();
    for (const std::array<std::size_t, 2>& corner :
         {std::array<std::size_t, 2>{0, 0}, std::array<std::size_t, 2>{320, 256},
          std::array<std::size_t, 2>{624, 464}}) {
        RasterCase part = scene;
        part.camera.width = part.camera.height = 16;
        part.camera.cx -= static_cast<float>(corner[0]);
        part.camera.cy -= static_cast<float>(corner[1]);
        const std::vector<float> image =
            raster_image(context(), part, raster_desc(part, kRasterModes[1]));
        ASSERT_EQ(image.size(), 4 * part.pixels());
        double off = 0;
        for (std::size_t i = 0; i < image.size(); ++i) {
            const std::size_t y = corner[1] + i / 4 / 16;
            const std::size_t x = corner[0] + i / 4 % 16;
            off = std::max(
                off, static_cast<double>(std::abs(image[i] - whole[4 * (640 * y + x) + i % 4])));
        }
        // The clamp of the Jacobian moves with the image; a list that ends early is off by 0.1.
        EXPECT_LT(off, 0.02) << corner[0] << ", " << corner[1];
    }
}

/// One Gaussian reaches all of a row of 25000 tiles: every pixel is drawn.
TEST_P(RasterizerMemoryFull, TallImagesAreWhole) {
    RasterCase scene = long_list(0);
    scene.camera.height = 400000;
    scene.camera.cy = 200000;
    scene.scales.assign(6, 1e5F);
    raster::RasterDesc desc = raster_desc(scene, kRasterModes[1]);
    desc.extra = false;
    const std::vector<float> image = raster_image(context(), scene, desc);
    ASSERT_EQ(image.size(), 4 * scene.pixels());
    for (std::size_t p = 0; p < scene.pixels(); ++p) ASSERT_GT(image[4 * p + 3], 0.5F) << p;
}

}  // namespace
}  // namespace splat::test

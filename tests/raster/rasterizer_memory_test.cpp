// More pairs than the arrays hold, more than a binding can hold, and lists longer than loops.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <functional>

#include "ops/op_harness.h"
#include "raster/raster_scenes.h"
#include "raster/raster_session.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

class RasterizerMemory : public KernelsTest {
  protected:
    /// A device of the same kernels whose bindings end early.
    [[nodiscard]] std::shared_ptr<vk::Context> lowered(std::uint64_t binding_bytes) const {
        vk::ContextDesc desc = context_desc(GetParam());
        desc.device.fake = [binding_bytes](vk::DeviceInfo& info) {
            info.limits.max_storage_buffer_bytes = binding_bytes;
        };
        return make_context(desc);
    }
};
SPLAT_INSTANTIATE_KERNELS(RasterizerMemory);

/// Each Gaussian reaches every tile, faintly.
RasterCase wide_faint_scene(const SceneSize& size) {
    RasterCase scene = random_scene(size, 70, 0);
    Rng rng(71);
    for (float& scale : scene.scales) scale = static_cast<float>(3 + rng.uniform());
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

/// One call, forward and backward, weights of the loss always the same.
Drawn draw(vk::Context& context, const RasterCase& scene, raster::RasterDesc desc) {
    desc = with_gradients(desc);
    RasterSession session(context, scene, desc);
    Drawn drawn;
    const auto all = [&]() -> Status {
        SPLAT_TRY(session.status());
        SPLAT_TRY(session.forward());
        drawn.stats = session.rasterizer().stats();
        const auto pixels = static_cast<std::size_t>(desc.pixels());
        SPLAT_TRY(session.backward(normal_fill(4 * pixels, 1), normal_fill(pixels, 2)));
        drawn.image = session.image();
        drawn.gaussians = session.gradients();
        drawn.exported = session.exported();
        return {};
    };
    drawn.status = all();
    return drawn;
}

/// The arrays begin with room for 4096 pairs or 4 per Gaussian; this scene has 120 x 48. The same
/// scene with 1400 more behind the camera begins with room for all.
TEST_P(RasterizerMemory, GrowsToTheSameBits) {
    const RasterCase scene = wide_faint_scene({120, 120, 90});
    RasterCase roomy = scene;
    const RasterCase hidden = random_scene({1400, 120, 90}, 72, 0);
    for (const float opacity : hidden.opacities) roomy.opacities.push_back(0 * opacity);
    for (auto tensor : {&RasterCase::means, &RasterCase::scales, &RasterCase::rotations,
                        &RasterCase::sh})
        (roomy.*tensor).insert((roomy.*tensor).end(), (hidden.*tensor).begin(),
                               (hidden.*tensor).end());
    const Drawn grown = draw(context(), scene, raster_desc(scene, kRasterModes[1]));
    const Drawn at_once = draw(context(), roomy, raster_desc(roomy, kRasterModes[1]));
    ASSERT_OK(grown.status);
    ASSERT_OK(at_once.status);
    EXPECT_EQ(grown.stats.runs, 2U);
    EXPECT_EQ(at_once.stats.runs, 1U);
    EXPECT_EQ(grown.stats.pairs, at_once.stats.pairs);
    EXPECT_GT(grown.stats.pairs, 4096U);
    EXPECT_EQ(grown.image, at_once.image);
    for (std::size_t i = 0; i < 12 * scene.count(); ++i)
        ASSERT_EQ(grown.gaussians[i], at_once.gaussians[i]) << i;
}

TEST_P(RasterizerMemory, GrowsOnce) {
    const RasterCase scene = wide_faint_scene({120, 120, 90});
    RasterSession session(context(), scene, raster_desc(scene, kRasterModes[0]));
    ASSERT_OK(session.status());
    ASSERT_OK(session.forward());
    EXPECT_EQ(session.rasterizer().stats().runs, 2U);
    const std::vector<float> image = session.image();
    ASSERT_OK(session.forward());
    EXPECT_EQ(session.rasterizer().stats().runs, 1U);
    EXPECT_EQ(session.image(), image);
}

/// Records of 16 bytes per pair: bindings as large as the image hold 256 pairs per tile.
void expect_same_in_groups(vk::Context& whole_device, vk::Context& narrow, const RasterCase& scene,
                           const RasterMode& mode, std::uint32_t least_passes) {
    const raster::RasterDesc desc = raster_desc(scene, mode);
    const Drawn whole = draw(whole_device, scene, desc);
    const Drawn groups = draw(narrow, scene, desc);
    ASSERT_OK(whole.status);
    ASSERT_OK(groups.status);
    EXPECT_EQ(whole.stats.passes, 1U);
    EXPECT_GE(groups.stats.passes, least_passes);
    EXPECT_EQ(groups.stats.pairs, whole.stats.pairs);
    EXPECT_EQ(groups.stats.visible, whole.stats.visible);
    EXPECT_EQ(groups.stats.longest, whole.stats.longest);
    EXPECT_EQ(groups.image, whole.image);
    // Sums over 12 tiles in another order, then a projection that cancels some of them.
    const double difference = relative_difference(groups.gaussians, whole.gaussians);
    const double exported = relative_difference(groups.exported, whole.exported);
    std::printf("%u passes: gradients differ by %.1e, exported ones by %.1e\n",
                groups.stats.passes, difference, exported);
    EXPECT_LE(difference, 5e-6);
    EXPECT_LE(exported, 5e-6);
}

TEST_P(RasterizerMemory, GroupsOfTileRowsGiveTheSameImage) {
    const RasterCase scene = wide_faint_scene({300, 32, 96});
    const auto narrow = lowered(16 * scene.pixels());
    ASSERT_NE(narrow, nullptr);
    expect_same_in_groups(context(), *narrow, scene, kRasterModes[0], 2);
}

/// 1100 Gaussians in 4 tiles of a row, room for 3300 pairs.
TEST_P(RasterizerMemory, RefusesRowsThatNoBindingHolds) {
    const RasterCase scene = wide_faint_scene({1100, 64, 48});
    const auto narrow = lowered(std::uint64_t{48} * 1100);
    ASSERT_NE(narrow, nullptr);
    RasterSession session(*narrow, scene, with_gradients(raster_desc(scene, kRasterModes[0])));
    ASSERT_OK(session.status());
    EXPECT_ERROR(session.forward(), Code::kUnsupported, "4400 ");
    EXPECT_ERROR(session.backward(std::vector<float>(4 * scene.pixels())), Code::kInvalidArgument,
                 "needs a forward call");
}

/// Two Gaussians that the middle pixel sees, and between them `count` that no pixel sees though they
/// reach the tile: opacity 0.005, points on the border between two pixels. Their list ends late, and
/// the image and the gradient are those of the two alone, bit by bit.
RasterCase long_list(std::size_t count) {
    RasterCase scene = empty_scene({0, 16, 16});
    scene.name = "list of " + std::to_string(count);
    scene.camera.world_to_camera = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    scene.camera.fx = scene.camera.fy = 16;
    scene.camera.cx = scene.camera.cy = 8;
    const auto add = [&](float pixel_x, float pixel_y, float z, float scale, float opacity) {
        scene.means.insert(scene.means.end(),
                           {(pixel_x - 8) / 16 * z, (pixel_y - 8) / 16 * z, z});
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

/// Lists are either right to the last entry or refused with the number of entries that is possible.
void expect_right_or_refused(vk::Context& context, std::size_t count, bool backward, bool blocks,
                             std::uint64_t must_do) {
    const RasterCase scene = long_list(count);
    const RasterCase two = long_list(0);
    raster::RasterDesc desc = raster_desc(scene, kRasterModes[1]);
    desc.skips.blocks = blocks;
    desc.backward = backward;
    RasterSession session(context, scene, desc);
    ASSERT_OK(session.status());
    const Status status = session.forward();
    if (!status.ok()) {
        EXPECT_ERROR(status, Code::kUnsupported, "Gaussians on one tile, but loops");
        EXPECT_GT(count, must_do) << "refused";
        return;
    }
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

/// What must be possible: Rasterizer::list_limit says how it was measured.
std::uint64_t least_list(vk::Kernels kernels, bool backward) {
    const bool cpu = kernels == vk::Kernels::kCpu;
    if (backward) return cpu ? 52000 : 2300;
    return cpu ? 174000 : 63000;
}

/// Just below what is possible, and above, with two entries more than `count`.
TEST_P(RasterizerMemory, LongListsAreRightOrRefused) {
    for (const std::size_t count : {100U, 2298U, 2299U, 2400U, 4000U})
        expect_right_or_refused(context(), count, true, true, least_list(GetParam(), true) - 2);
}

class RasterizerMemoryFull : public RasterizerMemory {};
SPLAT_INSTANTIATE_KERNELS(RasterizerMemoryFull);

TEST_P(RasterizerMemoryFull, GroupsOfTileRowsGiveTheSameImage) {
    for (const std::size_t count : {300, 1000}) {
        const RasterCase scene = wide_faint_scene({count, 32, 96});
        const auto narrow = lowered(16 * scene.pixels());
        ASSERT_NE(narrow, nullptr);
        for (const RasterMode& mode : kRasterModes) {
            SCOPED_TRACE(mode.name);
            expect_same_in_groups(context(), *narrow, scene, mode, count == 300 ? 2 : 5);
        }
    }
}

TEST_P(RasterizerMemoryFull, VeryLongListsAreRightOrRefused) {
    for (const bool backward : {false, true}) {
        const std::uint64_t least = least_list(GetParam(), backward);
        for (const bool blocks : {true, false})
            for (const std::uint64_t count :
                 {least / 2, least - 9, least - 2, least - 1, least + 400, least * 4})
                expect_right_or_refused(context(), count, backward, blocks, least - 2);
    }
}

/// A row of 25000 tiles, all of which one Gaussian reaches: no pixel is left out.
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

// Skips: the results have the same bits with each of them off.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "ops/op_harness.h"
#include "raster/raster_scenes.h"
#include "raster/raster_session.h"
#include "support/gpu_buffers.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

class RasterizerSkips : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(RasterizerSkips);

struct Skip {
    const char* name;
    bool raster::Skips::*member;
};
constexpr Skip kSkips[] = {
    {"opacity_extent", &raster::Skips::opacity_extent},
    {"exact_tiles", &raster::Skips::exact_tiles},
    {"cull", &raster::Skips::cull},
    {"blocks", &raster::Skips::blocks},
    {"early_out", &raster::Skips::early_out},
    {"unchanged", &raster::Skips::unchanged},
};

struct Bits {
    std::vector<float> image, gradients, exported;
    raster::RasterStats stats;
};

Bits bits_of(vk::Context& context, const RasterCase& scene, const raster::RasterDesc& desc) {
    RasterSession session(context, scene, with_gradients(desc));
    EXPECT_OK(session);
    if (!session.status().ok()) return {};
    EXPECT_OK(session.forward());
    const std::size_t pixels = scene.pixels();
    EXPECT_OK(session.backward(normal_fill(4 * pixels, 1), normal_fill(pixels, 2)));
    return {session.image(), session.gradients(), session.exported(), session.rasterizer().stats()};
}

/// Skipped entries have zero records, so gradients have the same bits, too (0 and -0 compare
/// equal).
void expect_equal(const Bits& got, const Bits& expected, const std::string& what) {
    EXPECT_EQ(got.image, expected.image) << what;
    EXPECT_EQ(got.gradients, expected.gradients) << what;
    EXPECT_EQ(got.exported, expected.exported) << what;
}

std::vector<RasterCase> scenes() {
    RasterCase faint = random_scene({80, 75, 41}, 83, 0);  // around the threshold of 1/255
    for (std::size_t i = 0; i < faint.count(); ++i) faint.opacities[i] *= i % 2 == 0 ? 0.02F : 0.2F;
    return {random_scene({80, 75, 41}, 81, 1), opaque_scene({80, 75, 41}, 82), faint,
            needle_scene({60, 75, 41}, 84), splatter_scene(14, 50, 41, 85)};
}

void expect_same_bits(vk::Context& context, const std::vector<RasterCase>& cases,
                      std::span<const RasterMode> modes) {
    for (const RasterCase& scene : cases) {
        for (const RasterMode& mode : modes) {
            const raster::RasterDesc desc = raster_desc(scene, mode);
            const Bits expected = bits_of(context, scene, desc);
            raster::RasterDesc everything = desc;
            for (const Skip& skip : kSkips) {
                raster::RasterDesc without = desc;
                without.skips.*skip.member = false;
                everything.skips.*skip.member = false;
                expect_equal(bits_of(context, scene, without), expected,
                             scene.name + " " + mode.name + " without " + skip.name);
            }
            expect_equal(bits_of(context, scene, everything), expected,
                         scene.name + " " + mode.name + " without any");
        }
    }
}

TEST_P(RasterizerSkips, EachOneOffGivesTheSameBits) {
    RasterCase faint = scenes()[2];
    faint.camera.width = 40;
    expect_same_bits(context(), {faint}, std::span(kRasterModes).first(2));
    RasterCase cut = opaque_scene({40, 40, 41}, 95);  // reaches beyond 3 sigma
    for (float& scale : cut.scales) scale *= 0.5F;
    expect_same_bits(context(), {cut}, std::span(kDrawnModes).last(2));
}

class RasterizerSkipsFull : public RasterizerSkips {};
SPLAT_INSTANTIATE_KERNELS(RasterizerSkipsFull);

TEST_P(RasterizerSkipsFull, EachOneOffGivesTheSameBits) {
    expect_same_bits(context(), scenes(), kRasterModes);
    expect_same_bits(context(), scenes(), kDrawnModes);
}

/// Each skip saves some work; otherwise the test above would prove nothing.
TEST_P(RasterizerSkips, EachOneLeavesOutWork) {
    const RasterCase scene = scenes()[2];
    const raster::RasterDesc desc = raster_desc(scene, kRasterModes[0]);
    const auto stats_without = [&](bool raster::Skips::*member) {
        raster::RasterDesc without = desc;
        without.skips.*member = false;
        return bits_of(context(), scene, without).stats;
    };
    raster::RasterDesc square = desc;
    square.skips.exact_tiles = false;
    const raster::RasterStats all = bits_of(context(), scene, desc).stats;
    const raster::RasterStats boxes = bits_of(context(), scene, square).stats;
    square.skips.opacity_extent = false;
    EXPECT_LT(all.pairs, boxes.pairs) << "exact_tiles";
    EXPECT_LT(boxes.pairs, bits_of(context(), scene, square).stats.pairs) << "opacity_extent";
    EXPECT_LT(all.visible, stats_without(&raster::Skips::cull).visible) << "cull";
}

/// Gaussians behind others that stop every pixel are not read: their numbers are overwritten before
/// the backward pass.
TEST_P(RasterizerSkips, OccludedOnesHaveNoBackwardPass) {
    constexpr std::size_t kFront = 12;
    RasterCase scene = random_scene({40, 37, 29}, 87, 1);
    scene.camera.world_to_camera = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    for (std::size_t i = 0; i < scene.count(); ++i) {
        scene.means[3 * i + 2] = i < kFront ? 2 : 6;
        if (i >= kFront) continue;
        scene.opacities[i] = 1;
        for (std::size_t k = 0; k < 3; ++k) scene.scales[3 * i + k] = 9;
    }
    const raster::RasterDesc desc = with_gradients(raster_desc(scene, kRasterModes[1]));
    const std::vector<float> weights = normal_fill(4 * scene.pixels(), 1);
    RasterSession whole(context(), scene, desc);
    RasterSession spoiled(context(), scene, desc);
    ASSERT_OK(whole);
    ASSERT_OK(spoiled);
    ASSERT_OK(whole.forward());
    ASSERT_OK(whole.backward(weights));
    ASSERT_OK(spoiled.forward());
    EXPECT_GT(spoiled.rasterizer().stats().visible, scene.count() / 2) << "few are occluded";
    const auto spoil = [&](const vk::Buffer& buffer, std::size_t width) {
        std::vector<float> values = download(context(), buffer.range(), width * scene.count());
        std::fill(values.begin() + static_cast<std::ptrdiff_t>(width * kFront), values.end(),
                  std::numeric_limits<float>::quiet_NaN());
        ASSERT_OK(context().write(buffer.range(), values.data(), values.size() * sizeof(float)));
    };
    spoil(spoiled.scene().gaussians, 12);
    spoil(spoiled.scene().colors, std::size_t{4} * desc.color_quads());
    ASSERT_OK(spoiled.backward(weights));
    EXPECT_EQ(spoiled.gradients(), whole.gradients());
    EXPECT_EQ(spoiled.exported(), whole.exported());
    const std::vector<float> exported = whole.exported();
    EXPECT_EQ(std::vector<float>(exported.begin() + 12 * kFront, exported.end()),
              std::vector<float>(exported.size() - 12 * kFront));
}

/// Bands of zeros give the same bits as bands that are not evaluated. NaNs show that the latter are
/// not read.
TEST_P(RasterizerSkips, BandsThatTheSceneLacks) {
    constexpr std::size_t kNumbers = 48;  // numbers per Gaussian: degree 3
    constexpr std::size_t kThere = 12;    // degree 1
    RasterCase scene = random_scene({60, 37, 29}, 89, 3);
    for (std::size_t i = 0; i < scene.sh.size(); ++i)
        if (i % kNumbers >= kThere) scene.sh[i] = 0;
    RasterSession session(context(), scene, raster_desc(scene, kRasterModes[0]));
    ASSERT_OK(session);
    const scene::Camera camera = camera_of(scene);
    ASSERT_OK(session.draw(session.scene().views(), {&camera, 1}));
    const std::vector<float> expected = session.image();
    gaussians::SetViews lower = session.scene().views();
    lower.sh_degree = 1;
    for (std::size_t i = 0; i < scene.sh.size(); ++i)
        if (i % kNumbers >= kThere) scene.sh[i] = std::numeric_limits<float>::quiet_NaN();
    ASSERT_OK(context().write(lower.colors, scene.sh.data(), scene.sh.size() * sizeof(float)));
    ASSERT_OK(session.draw(lower, {&camera, 1}));
    EXPECT_EQ(session.image(), expected);
    EXPECT_GT(session.rasterizer().stats().visible, 50U);
    ASSERT_OK(session.draw(session.scene().views(), {&camera, 1}));
    EXPECT_EQ(session.rasterizer().stats().visible, 0U) << "all bands, recorded anew";
}

/// Compensation makes Gaussians much smaller than a pixel too faint to be seen.
TEST_P(RasterizerSkips, SubPixelGaussiansThatAreCompensated) {
    RasterCase scene = random_scene({400, 75, 41}, 86, 0);
    for (float& scale : scene.scales) scale *= 0.02F;
    raster::RasterDesc desc = raster_desc(scene, kRasterModes[0]);
    const raster::RasterStats dilated = bits_of(context(), scene, desc).stats;
    desc.antialiased = true;
    const Bits with = bits_of(context(), scene, desc);
    desc.skips.cull = false;
    const Bits without = bits_of(context(), scene, desc);
    expect_equal(with, without, "antialiased, without cull");
    EXPECT_GT(with.stats.visible, 0U) << "the test needs some to be seen";
    EXPECT_LT(with.stats.visible, without.stats.visible / 2);
    EXPECT_LT(with.stats.visible, dilated.visible / 2) << "seen without compensation";
}

/// Several rows without tiles at the rim of a footprint, where extents ignore the opacity.
TEST_P(RasterizerSkips, EmptyRowsOfAFootprint) {
    RasterCase scene = random_scene({300, 150, 130}, 77, 0);
    for (std::size_t i = 0; i < scene.count(); ++i) {
        scene.opacities[i] = 0.0045F + 0.0001F * static_cast<float>(i % 20);
        for (std::size_t k = 0; k < 3; ++k) scene.scales[3 * i + k] *= 2;
    }
    for (const RasterMode& mode : kRasterModes) {
        SCOPED_TRACE(mode.name);
        const raster::RasterDesc desc = raster_desc(scene, mode);
        raster::RasterDesc wide = desc;
        wide.skips.opacity_extent = false;
        const RasterRun with = run_raster(context(), scene, desc);
        const RasterRun without = run_raster(context(), scene, wide);
        ASSERT_OK(with.status);
        ASSERT_OK(without.status);
        EXPECT_GT(with.stats.pairs, 0U);
        EXPECT_EQ(with.image, without.image);
    }
}

/// Faint needles that miss the pixel centres of whole rows of tiles and hit some in later rows.
TEST_P(RasterizerSkips, EmptyRowsWithinAFootprint) {
    RasterCase scene = random_scene({4000, 150, 130}, 78, 0);
    for (std::size_t i = 0; i < scene.count(); ++i) {
        scene.opacities[i] = 0.00398F + 0.00001F * static_cast<float>(i % 16);
        for (std::size_t k = 0; k < 3; ++k) scene.scales[3 * i + k] *= k == 0 ? 40 : 0.01F;
    }
    const raster::RasterDesc desc = raster_desc(scene, kRasterModes[0]);
    raster::RasterDesc all = desc;
    all.skips.exact_tiles = false;
    const RasterRun with = run_raster(context(), scene, desc);
    const RasterRun without = run_raster(context(), scene, all);
    ASSERT_OK(with.status);
    ASSERT_OK(without.status);
    EXPECT_GT(with.stats.pairs, 0U);
    EXPECT_EQ(with.image, without.image);
}

}  // namespace
}  // namespace splat::test

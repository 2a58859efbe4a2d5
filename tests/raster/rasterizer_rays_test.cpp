// The convention ray_maximum: opacity and depth at the maximum along the ray of each pixel, without a dilation.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "ops/op_harness.h"
#include "raster/fragile.h"
#include "raster/raster_scenes.h"
#include "raster/raster_session.h"
#include "ref/rasterize_ref.h"
#include "support/gpu_buffers.h"

namespace splat::test {
namespace {

class RasterizerRays : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(RasterizerRays);

/// Compares all outputs with float64. Returns the share of the pixels that rounding decides.
double expect_rays(vk::Context& context, const RasterCase& from, const RasterMode& mode,
                   const std::vector<bool>& hostile = {}) {
    const auto scene = reference_scene<double>(from, mode);
    // Without a dilation what is flat is as thin as needles are.
    const bool thin = has_needles(from) || std::ranges::count(from.scales, 0.0F) > 0;
    const RasterJudge judge = thin ? RasterJudge::kFloat32Needles : RasterJudge::kFloat32;
    RasterSubject subject = {from.name + " " + mode.name, judge, fragile_pixels(scene), hostile,
                             from.opacities};
    subject.rays = true;
    const RasterRun run = run_raster(context, from, raster_desc(from, mode));
    EXPECT_OK(run.status) << subject.what;
    if (!run.status.ok()) return 1;
    EXPECT_TRUE(outputs_match(run.outputs, reference_outputs(scene), subject));
    const auto spoiled = std::count(subject.fragile.begin(), subject.fragile.end(), true);
    return static_cast<double>(spoiled) / static_cast<double>(subject.fragile.size());
}

/// A camera at the origin that looks along z.
RasterCase empty_case(std::size_t width, std::size_t height) {
    RasterCase scene;
    scene.name = "rays";
    scene.camera.width = width;
    scene.camera.height = height;
    scene.camera.fx = scene.camera.fy = 32;
    scene.camera.cx = static_cast<float>(width) / 2;
    scene.camera.cy = static_cast<float>(height) / 2;
    return scene;
}

void add(RasterCase& to, const std::array<float, 3>& mean, const std::array<float, 3>& scale,
         const std::array<float, 4>& rotation, float opacity) {
    to.means.insert(to.means.end(), mean.begin(), mean.end());
    to.scales.insert(to.scales.end(), scale.begin(), scale.end());
    to.rotations.insert(to.rotations.end(), rotation.begin(), rotation.end());
    to.opacities.push_back(opacity);
    to.colors.insert(to.colors.end(), {1, 0.5F, 0.25F});
}

/// random_scene with a third of flat discs and a third of points.
RasterCase flat_scene(const SceneSize& size, std::uint64_t seed) {
    RasterCase scene = random_scene(size, seed, 1);
    scene.name = "flat";
    for (std::size_t i = 0; i < scene.count(); ++i)
        for (std::size_t k = 0; k < i % 3; ++k) scene.scales[3 * i + k] = 0;
    return scene;
}

TEST_P(RasterizerRays, MatchFloat64) {
    RasterCase inside = random_scene({40, 45, 29}, 191, 2);
    inside.name = "inside";
    inside.camera.world_to_camera[11] = 0.5F;
    for (const RasterMode& mode : kRayModes) {
        EXPECT_LE(expect_rays(context(), random_scene({60, 37, 29}, 190, 1), mode), 0.3);
        expect_rays(context(), inside, mode);
    }
    expect_rays(context(), wide_scene({40, 37, 29}, 192), kRayModes[1]);
    expect_rays(context(), flat_scene({60, 33, 47}, 193), kRayModes[0]);
    expect_rays(context(), opaque_scene({30, 37, 29}, 194), kRayModes[0]);
    expect_rays(context(), splatter_scene(14, 50, 41, 195), kRayModes[0]);
    expect_rays(context(), tie_scene({40, 17, 15}, 196), kRayModes[0]);
    const HostileScene hostile = hostile_scene({80, 31, 33}, 197);
    expect_rays(context(), hostile.with, kRayModes[0], hostile.hostile);
}

TEST_P(RasterizerRays, NeedlesAndWhatIsFar) {
    for (const double length : {1.0, 30.0})
        expect_rays(context(), needle_scene({40, 47, 33}, 198, length), kRayModes[0]);
    // The picture stays from a thousand times as far, where a form along the ray would be a difference of 1e9s.
    RasterCase far = random_scene({60, 37, 29}, 199, 0);
    far.name = "far";
    for (float& value : far.means) value *= 1000;
    for (float& value : far.scales) value *= 1000;
    for (const std::size_t k : {3U, 7U, 11U}) far.camera.world_to_camera[k] *= 1000;
    expect_rays(context(), far, kRayModes[0]);
    for (float& value : far.scales) value *= 0.02F;
    far.name = "far and small";
    far.camera.fx *= 20;
    far.camera.fy *= 20;
    expect_rays(context(), far, kRayModes[0]);
}

/// Gaussians alone, as large as they can be seen or larger, from before the near plane to behind the image: no pixel
/// outside the box that the kernels found sees one.
TEST_P(RasterizerRays, BoxesHoldAllThatIsSeen) {
    std::size_t seen = 0;
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
        const std::vector<float> r = normal_fill(11, 300 + seed);
        RasterCase scene = empty_case(71, 53);
        const float size = std::exp(1.5F * r[10] - 1);
        add(scene, {2 * r[0], 2 * r[1], 0.21F + std::abs(2 * r[2])},
            {size * std::exp(r[3]), size * std::exp(r[4]),
             seed % 4 == 0 ? 0 : size * std::exp(r[5])},
            {r[6], r[7], r[8], r[9]}, seed % 3 == 0 ? 0.05F : 1.0F);
        scene.name = "one Gaussian " + std::to_string(seed);
        const auto projected = ref::project_forward(reference_scene<double>(scene, kRayModes[0]));
        if (projected.order.empty()) continue;
        const ref::BlendForward<double> image =
            ref::blend_forward(reference_scene<double>(scene, kRayModes[0]), projected);
        if (*std::ranges::max_element(image.alpha) == 0) continue;
        ++seen;
        expect_rays(context(), scene, kRayModes[0]);
    }
    EXPECT_GE(seen, 20U);
}

/// A disc that is turned by 45 degrees is where its plane is, at every pixel.
TEST_P(RasterizerRays, DepthIsThatOfADiscsPlane) {
    RasterCase scene = empty_case(37, 29);
    const float half = 0.38268343F;
    add(scene, {0, 0, 4}, {1, 1, 0}, {0.92387953F, 0, half, 0}, 1);
    RasterRun run = run_raster(context(), scene, raster_desc(scene, kRayModes[0]));
    ASSERT_OK(run.status);
    std::size_t seen = 0;
    for (std::size_t p = 0; p < scene.pixels(); ++p) {
        const double slope = (static_cast<double>(p % 37) + 0.5 - 18.5) / 32;
        if (run.outputs.alpha[p] == 0) {
            EXPECT_EQ(run.outputs.median[p], 0);
            continue;
        }
        ++seen;
        EXPECT_NEAR(run.outputs.median[p], 4 / (1 + slope), 2e-4) << p;
        EXPECT_NEAR(run.outputs.depth_expected[p], run.outputs.median[p], 2e-4) << p;
    }
    EXPECT_GT(seen, 100U);
    run = run_raster(context(), scene, raster_desc(scene, kRasterModes[1]));
    EXPECT_NEAR(run.outputs.median[14 * 37 + 24], 4, 1e-5) << "elsewhere it is the mean's";
}

/// Without a dilation what lies between the centres of pixels is not seen.
TEST_P(RasterizerRays, NoDilation) {
    RasterCase scene = empty_case(33, 31);
    add(scene, {1 / 64.0F, 1 / 64.0F, 1}, {1e-3F, 1e-3F, 1e-3F}, {1, 0, 0, 0}, 1);
    const auto largest = [&](const RasterMode& mode) {
        const RasterRun run = run_raster(context(), scene, raster_desc(scene, mode));
        EXPECT_OK(run.status);
        return *std::ranges::max_element(run.outputs.alpha);
    };
    EXPECT_EQ(largest(kRayModes[0]), 0);
    EXPECT_GT(largest(kRasterModes[1]), 0.1);
    scene.means[0] = 0;  // a centre of a pixel
    scene.means[1] = 0;
    scene.camera.cx = 16.5F;
    scene.camera.cy = 15.5F;
    EXPECT_GT(largest(kRayModes[0]), 0.98);
}

TEST_P(RasterizerRays, SkipsChangeNoBit) {
    RasterCase faint = random_scene({80, 75, 41}, 183, 0);
    for (std::size_t i = 0; i < faint.count(); ++i) faint.opacities[i] *= i % 2 == 0 ? 0.02F : 0.2F;
    for (const RasterCase& scene : {flat_scene({80, 75, 41}, 181), opaque_scene({80, 75, 41}, 182),
                                    faint, needle_scene({60, 75, 41}, 184)}) {
        const raster::RasterDesc desc = raster_desc(scene, kRayModes[0]);
        const std::vector<float> expected = raster_image(context(), scene, desc);
        for (const auto skip :
             {&raster::Skips::opacity_extent, &raster::Skips::exact_tiles, &raster::Skips::cull,
              &raster::Skips::blocks, &raster::Skips::early_out}) {
            raster::RasterDesc without = desc;
            without.skips.*skip = false;
            EXPECT_EQ(raster_image(context(), scene, without), expected) << scene.name;
        }
    }
}

TEST_P(RasterizerRays, RefuseGradientsAndCompensation) {
    const RasterCase scene = random_scene({10, 20, 20}, 185);
    for (const auto what : {&raster::RasterDesc::backward, &raster::RasterDesc::antialiased}) {
        raster::RasterDesc desc = raster_desc(scene, kRayModes[0]);
        desc.*what = true;
        EXPECT_ERROR(raster::Rasterizer::create(context(), desc).status(), Code::kInvalidArgument,
                     "ray_maximum has neither gradients nor a dilation");
    }
}

}  // namespace
}  // namespace splat::test

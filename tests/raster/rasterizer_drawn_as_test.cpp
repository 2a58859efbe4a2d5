// Scenes that are blended by distance or cut at 3 sigma, as some files ask for.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "ops/op_harness.h"
#include "raster/raster_scenes.h"
#include "raster/raster_session.h"
#include "ref/rasterize_ref.h"

namespace splat::test {
namespace {

class RasterizerDrawnAs : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(RasterizerDrawnAs);

/// A camera at the origin that looks along z, with a field of view of 90 degrees.
RasterCase two_gaussians() {
    RasterCase scene;
    scene.name = "two";
    scene.camera.width = 33;
    scene.camera.height = 31;
    scene.camera.fx = scene.camera.fy = 16;
    scene.camera.cx = 16.5F;
    scene.camera.cy = 15.5F;
    scene.sh_coefficients = 0;
    return scene;
}

void add(RasterCase& to, std::array<float, 3> mean, float scale, float opacity,
         std::array<float, 3> color) {
    to.means.insert(to.means.end(), mean.begin(), mean.end());
    to.scales.insert(to.scales.end(), 3, scale);
    to.rotations.insert(to.rotations.end(), {1, 0, 0, 0});
    to.opacities.push_back(opacity);
    to.colors.insert(to.colors.end(), color.begin(), color.end());
}

TEST_P(RasterizerDrawnAs, MatchFloat64) {
    RasterCase inside = random_scene({40, 45, 29}, 91, 2);  // seen far from the axis
    inside.camera.world_to_camera[11] = 1;
    for (const RasterMode& mode : kDrawnModes) {
        EXPECT_LE(expect_like_reference(context(), random_scene({60, 37, 29}, 90, 1), mode).fragile,
                  0.3)
            << mode.name;
        expect_like_reference(context(), wide_scene({40, 37, 29}, 92), mode);
        expect_like_reference(context(), inside, mode);
    }
    expect_like_reference(context(), opaque_scene({30, 37, 29}, 93), kDrawnModes[2],
                          ref::RasterGradient::kOriginal);
}

/// The red one has the smaller depth, 2 against 2.3, but is farther away, 2.7 against 2.5. Both cover a pixel between.
TEST_P(RasterizerDrawnAs, TheNearerOneIsInFront) {
    RasterCase scene = two_gaussians();
    add(scene, {1.8F, 0, 2}, 1, 0.9F, {1, 0, 0});
    add(scene, {0.9F, 0, 2.3F}, 1, 0.9F, {0, 1, 0});
    const std::size_t pixel = 15 * 33 + 26;
    const auto drawn = [&](bool by_distance) {
        raster::RasterDesc desc = raster_desc(scene, kRasterModes[1]);
        desc.sort_by_distance = by_distance;
        return run_raster(context(), scene, desc);
    };
    const RasterRun by_depth = drawn(false), by_distance = drawn(true);
    ASSERT_OK(by_depth.status);
    ASSERT_OK(by_distance.status);
    EXPECT_GT(by_depth.outputs.rgb[3 * pixel], by_depth.outputs.rgb[3 * pixel + 1]);
    EXPECT_LT(by_distance.outputs.rgb[3 * pixel], by_distance.outputs.rgb[3 * pixel + 1]);
    EXPECT_EQ(by_distance.outputs.depths, by_depth.outputs.depths) << "depths stay along z";
    EXPECT_GT(by_distance.outputs.depth_expected[pixel], by_depth.outputs.depth_expected[pixel]);
    EXPECT_LE(by_distance.outputs.depth_expected[pixel], 2.3 + 1e-6);
}

/// Equal distances: in the order of the indices.
TEST_P(RasterizerDrawnAs, EqualDistancesInOrderOfIndices) {
    for (const float side : {-0.5F, 0.5F}) {
        RasterCase scene = two_gaussians();
        add(scene, {side, 0, 2}, 1, 0.9F, {1, 0, 0});
        add(scene, {-side, 0, 2}, 1, 0.9F, {0, 1, 0});
        raster::RasterDesc desc = raster_desc(scene, kRasterModes[0]);
        desc.sort_by_distance = true;
        const std::vector<float> image = raster_image(context(), scene, desc);
        ASSERT_EQ(image.size(), 4 * scene.pixels());
        const std::size_t middle = 15 * 33 + 16;
        EXPECT_GT(image[4 * middle], 2 * image[4 * middle + 1]) << side;
    }
}

/// Pixels see one opaque Gaussian exactly within 3 sigma of its dilated ellipse; uncut it reaches 3.33 sigma.
TEST_P(RasterizerDrawnAs, EndsAt3Sigma) {
    RasterCase scene = two_gaussians();
    add(scene, {0.1F, -0.05F, 2}, 0.4F, 1, {1, 1, 1});
    scene.scales[1] = 0.2F;
    for (const RasterMode& mode : {kRasterModes[1], kRasterModes[2]}) {
        const auto projected = ref::project_forward(reference_scene<double>(scene, mode));
        const auto& g = projected.gaussians[0];
        raster::RasterDesc desc = raster_desc(scene, mode);
        const RasterRun uncut = run_raster(context(), scene, desc);
        desc.cut_3_sigma = true;
        const RasterRun cut = run_raster(context(), scene, desc);
        ASSERT_OK(uncut.status);
        ASSERT_OK(cut.status);
        std::size_t ended = 0;
        for (std::size_t p = 0; p < scene.pixels(); ++p) {
            const double dx = g.mean2d[0] - (static_cast<double>(p % 33) + 0.5);
            const double dy = g.mean2d[1] - (static_cast<double>(p / 33) + 0.5);
            const double squared =
                g.conic[0] * dx * dx + g.conic[2] * dy * dy + 2 * g.conic[1] * dx * dy;
            if (std::abs(squared - 9) < 1e-3) continue;
            EXPECT_EQ(cut.outputs.alpha[p], squared < 9 ? uncut.outputs.alpha[p] : 0.0)
                << p << " " << mode.name;
            ended += squared > 9 && uncut.outputs.alpha[p] > 0 ? 1 : 0;
        }
        EXPECT_GT(ended, 10U) << mode.name;
    }
}

/// Extents end at 3 sigma, too.
TEST_P(RasterizerDrawnAs, FewerPairs) {
    RasterCase scene = opaque_scene({60, 145, 129}, 94);
    raster::RasterDesc desc = raster_desc(scene, kRasterModes[1]);
    const RasterRun uncut = run_raster(context(), scene, desc);
    desc.cut_3_sigma = true;
    const RasterRun cut = run_raster(context(), scene, desc);
    ASSERT_OK(uncut.status);
    ASSERT_OK(cut.status);
    EXPECT_LT(cut.stats.pairs, uncut.stats.pairs);
}

}  // namespace
}  // namespace splat::test

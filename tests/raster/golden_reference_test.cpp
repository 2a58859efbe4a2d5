// Checks the float64 reference against golden/raster/*.npz, with every mode and key of every file,
// and the comparisons themselves on the float32 reference, as they judge kernels.
#include <gtest/gtest.h>

#include <set>

#include "raster/golden_scene.h"
#include "raster/raster_compare.h"

namespace splat::test {
namespace {

/// One test per family, so that a failure names it. The family "" would be all files.
class GoldenRasterReference : public testing::TestWithParam<const char*> {
  protected:
    void SetUp() override { SPLAT_NEEDS_GOLDEN_FOLDER(); }

    static void expect_mode(const GoldenScene& scene, const RasterMode& mode) {
        const RasterSubject subject = golden_subject(scene, mode, RasterJudge::kFloat64);
        const auto inputs = reference_scene<double>(scene.inputs, mode);
        EXPECT_TRUE(outputs_match(reference_outputs(inputs, true), scene.outputs(mode), subject));
        for (const GoldenLoss& loss : golden_losses(mode)) {
            const RasterGradients expected = scene.gradients(mode, loss);
            if (expected.means.empty()) continue;
            const auto graded = reference_scene<double>(scene.inputs, mode, loss.gradient);
            EXPECT_TRUE(gradients_match(reference_gradients(graded, scene.loss<double>(loss)),
                                        expected, subject))
                << loss.name;
        }
    }
};

TEST_P(GoldenRasterReference, MatchesEveryKey) {
    for (const GoldenScene& scene : golden_scenes(GetParam())) {
        std::size_t modes = 0;
        for (const RasterMode& mode : kRasterModes) {
            if (!scene.has(mode)) continue;
            ++modes;
            expect_mode(scene, mode);
        }
        EXPECT_GE(modes, 2U) << scene.inputs.name;
    }
}

INSTANTIATE_TEST_SUITE_P(Families, GoldenRasterReference, testing::ValuesIn(kGoldenFamilies),
                         [](const auto& family) { return std::string(family.param); });

class GoldenRasterFiles : public testing::Test {
  protected:
    void SetUp() override { SPLAT_NEEDS_GOLDEN_FOLDER(); }
};

/// No kernel would be judged by a key that the loader does not know.
TEST_F(GoldenRasterFiles, HoldOnlyKnownKeys) {
    static const std::set<std::string> kKnown = {
        "rgb",        "alpha",       "depth_acc",      "depth_exp",
        "n_contrib",  "means2d",     "conics",         "depths",
        "radii",      "valid",       "colors",         "order",
        "tiles_rect", "tiles_exact", "pixels_visible", "compensations",
        "means",      "quats",       "scales",         "opacities",
        "sh",         "viewmat",     "viewmat_twist",  "loss_rgb",
        "loss_all"};
    for (const GoldenScene& scene : golden_scenes(""))
        for (const std::string& name : scene.arrays.names())
            EXPECT_TRUE(name.find('/') == std::string::npos ||
                        kKnown.contains(name.substr(name.rfind('/') + 1)))
                << name;
}

/// loss_rgb and loss_all: the gradients use the weights in the same sense.
TEST_F(GoldenRasterFiles, HoldTheLossesOfTheirWeights) {
    const auto weighted = [](const std::vector<float>& weights, const std::vector<double>& image) {
        double sum = 0;
        for (std::size_t i = 0; i < weights.size(); ++i)
            sum += static_cast<double>(weights[i]) * image.at(i);
        return sum;
    };
    std::size_t count = 0;
    for (const GoldenScene& scene : golden_scenes(""))
        for (const RasterMode& mode : kRasterModes) {
            const std::string folder = std::string(mode.name) + "/";
            if (!scene.has(mode) || !scene.arrays.has(folder + "loss_rgb")) continue;
            const RasterOutputs out = scene.outputs(mode);
            const double rgb = weighted(scene.w_rgb, out.rgb);
            EXPECT_NEAR(rgb, scene.number(folder + "loss_rgb"), 1e-9) << scene.inputs.name;
            ++count;
            if (!scene.arrays.has(folder + "loss_all")) continue;
            const double all =
                rgb + weighted(scene.w_alpha, out.alpha) + weighted(scene.w_depth, out.depth);
            EXPECT_NEAR(all, scene.number(folder + "loss_all"), 1e-9) << scene.inputs.name;
        }
    EXPECT_GT(count, 0U);
}

TEST_F(GoldenRasterFiles, SayWhyAGaussianIsHostile) {
    for (const GoldenScene& scene : golden_scenes("hostile")) {
        ASSERT_EQ(scene.hostile.size(), scene.inputs.count());
        ASSERT_EQ(scene.why.size(), scene.inputs.count());
        for (std::size_t i = 0; i < scene.why.size(); ++i)
            EXPECT_EQ(scene.why[i].empty(), !scene.hostile[i]) << scene.why[i];
    }
}

/// The float32 reference, as the simplest kernel, passes where kernels must. The figures of
/// support/raster_tolerances.h come from here.
TEST_F(GoldenRasterFiles, Float32PassesForwardGates) {
    for (const GoldenScene& scene : golden_scenes(""))
        for (const RasterMode& mode : kRasterModes) {
            if (!scene.has(mode)) continue;
            const RasterSubject subject = golden_subject(scene, mode, RasterJudge::kFloat32);
            const auto inputs = reference_scene<float>(scene.inputs, mode);
            EXPECT_TRUE(outputs_match(reference_outputs(inputs), scene.outputs(mode), subject));
        }
}

}  // namespace
}  // namespace splat::test

// The comparisons find each kind of defect and accept float32, and the scenes are as described.
#include "raster/raster_compare.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "raster/fragile.h"
#include "raster/raster_scenes.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

/// A scene with results and gradients of the reference.
struct Judged {
    RasterCase from;
    RasterMode mode;
    RasterSubject subject;
    RasterOutputs outputs;
    RasterGradients gradients;
    ref::RasterLoss<double> loss;

    Judged(RasterCase given, const RasterMode& given_mode)
        : from(std::move(given)), mode(given_mode) {
        const auto scene = reference_scene<double>(from, mode);
        subject.what = from.name + " " + mode.name;
        subject.judge = has_needles(from) ? RasterJudge::kFloat32Needles : RasterJudge::kFloat32;
        subject.fragile = fragile_pixels(scene);
        subject.opacities = from.opacities;
        loss.grad_rgb = to_double(loss_weights(subject.fragile, 3, 61));
        loss.grad_alpha = to_double(loss_weights(subject.fragile, 1, 62));
        loss.grad_depth = to_double(loss_weights(subject.fragile, 1, 63));
        outputs = reference_outputs(scene);
        gradients = reference_gradients(scene, loss);
    }

    [[nodiscard]] std::size_t fragile_count() const {
        return static_cast<std::size_t>(
            std::count(subject.fragile.begin(), subject.fragile.end(), true));
    }
};

std::vector<RasterCase> scenes() {
    return {random_scene({300, 70, 50}, 51, 3),
            needle_scene({60, 80, 64}, 53),
            tie_scene({60, 50, 40}, 54),
            hostile_scene({64, 60, 40}, 55).with,
            splatter_scene(24, 48, 40, 56),
            opaque_scene({200, 50, 38}, 57),
            wide_scene({60, 60, 47}, 58),
            empty_scene({10, 20, 17}),
            empty_scene({0, 20, 17})};
}

TEST(RasterScenes, Float32PassesForwardGates) {
    for (const RasterCase& scene : scenes())
        for (const RasterMode& mode : kRasterModes) {
            const Judged judged(scene, mode);
            const auto in_float = reference_outputs(reference_scene<float>(scene, mode));
            EXPECT_TRUE(outputs_match(in_float, judged.outputs, judged.subject));
            EXPECT_LT(judged.fragile_count(), scene.pixels() / 20) << judged.subject.what;
        }
}

TEST(RasterScenes, HostileOnesHaveNoEffect) {
    const HostileScene scene = hostile_scene({64, 60, 40}, 59);
    for (const RasterMode& mode : kRasterModes) {
        const Judged with(scene.with, mode);
        const Judged without(scene.without, mode);
        EXPECT_EQ(with.outputs.rgb, without.outputs.rgb);
        EXPECT_EQ(with.outputs.n_contrib, without.outputs.n_contrib);
        RasterSubject subject = with.subject;
        subject.hostile = scene.hostile;
        EXPECT_TRUE(outputs_match(with.outputs, with.outputs, subject));
        EXPECT_TRUE(gradients_match(with.gradients, with.gradients, subject));
        for (std::size_t i = 0; i < scene.hostile.size(); ++i)
            EXPECT_EQ(with.outputs.valid[i] == 0, scene.hostile[i]) << i;
    }
}

TEST(RasterScenes, MatchTheirDescription) {
    const auto valid = [](const Judged& judged) {
        return std::count(judged.outputs.valid.begin(), judged.outputs.valid.end(), 1);
    };
    const Judged empty(empty_scene({10, 20, 17}), kRasterModes[0]);
    EXPECT_EQ(valid(empty), 0);
    for (std::size_t i = 0; i < empty.outputs.rgb.size(); ++i)
        EXPECT_EQ(empty.outputs.rgb[i], static_cast<double>(empty.from.background[i % 3]));
    const Judged splatter3dgs(splatter_scene(24, 48, 40, 56), kRasterModes[0]);
    const Judged splatter(splatter_scene(24, 48, 40, 56), kRasterModes[1]);
    EXPECT_LT(4 * valid(splatter), 3 * valid(splatter3dgs)) << "many below 1/255";
    EXPECT_TRUE(has_needles(needle_scene({60, 80, 64}, 53)));
    EXPECT_FALSE(has_needles(random_scene({300, 70, 50}, 51)));
    const Judged opaque(opaque_scene({200, 50, 38}, 57), kRasterModes[1]);
    double alpha = 0;
    for (const double value : opaque.outputs.alpha)
        alpha += value / static_cast<double>(opaque.outputs.alpha.size());
    EXPECT_GT(alpha, 0.95);
    const Judged ties(tie_scene({60, 50, 40}, 54), kRasterModes[1]);
    std::vector<double> depths = ties.outputs.depths;
    std::sort(depths.begin(), depths.end());
    EXPECT_EQ(std::unique(depths.begin(), depths.end()) - depths.begin(), 4);
}

/// A normal of a flat Gaussian is its thin axis, seen from the front.
TEST(RasterScenes, NormalsFaceTheCamera) {
    const Judged judged(random_scene({200, 50, 40}, 60), kRasterModes[1]);
    const auto projected = ref::project_forward(reference_scene<double>(judged.from, judged.mode));
    for (const std::uint32_t i : projected.order) {
        const ref::ProjectedGaussian<double>& g = projected.gaussians[i];
        EXPECT_NEAR(ref::dot(g.normal, g.normal), 1, 1e-12);
        EXPECT_LE(ref::dot(g.normal, g.camera_mean), 0);
    }
    RasterCase disc = random_scene({1, 20, 20}, 60);
    disc.camera = tie_scene({1, 20, 20}, 60).camera;
    disc.means = {0, 0, 0};
    disc.scales = {0.5F, 0.4F, 0.01F};
    disc.rotations = {1, 0, 0, 0};
    const Judged flat(disc, kRasterModes[1]);
    for (std::size_t p = 0; p < disc.pixels(); ++p)
        EXPECT_NEAR(flat.outputs.normal[3 * p + 2], -flat.outputs.alpha[p], 1e-15);
}

TEST(RasterCompare, FindsDefectsOfImages) {
    const Judged judged(random_scene({300, 70, 50}, 51), kRasterModes[0]);
    const auto refused = [&](const std::function<void(RasterOutputs&)>& damage) {
        RasterOutputs got = judged.outputs;
        EXPECT_TRUE(outputs_match(got, judged.outputs, judged.subject));
        damage(got);
        return !outputs_match(got, judged.outputs, judged.subject);
    };
    ASSERT_FALSE(judged.subject.fragile[1000]);
    EXPECT_TRUE(refused([](RasterOutputs& got) { got.rgb[3000] += 1.2e-5; }));
    EXPECT_TRUE(refused([](RasterOutputs& got) { got.alpha[1000] = std::nan(""); }));
    EXPECT_TRUE(refused([](RasterOutputs& got) { got.n_contrib[1000] += 1; }));
    EXPECT_TRUE(refused([](RasterOutputs& got) { got.radii[7] += 2; }));
    EXPECT_TRUE(refused([](RasterOutputs& got) { got.valid[7] ^= 1; }));
    EXPECT_TRUE(refused([](RasterOutputs& got) { got.means2d[7] += 1e-2; }));
    EXPECT_TRUE(refused([](RasterOutputs& got) { got.depth.pop_back(); }));
    EXPECT_TRUE(refused([](RasterOutputs& got) { got = {}; })) << "nothing was compared";
    EXPECT_FALSE(refused([](RasterOutputs& got) { got.rgb[3000] += 0.8e-5; }));
    EXPECT_FALSE(refused([](RasterOutputs& got) { got.depth_expected.clear(); }));
    const auto fragile = static_cast<std::size_t>(
        std::find(judged.subject.fragile.begin(), judged.subject.fragile.end(), true) -
        judged.subject.fragile.begin());
    ASSERT_LT(fragile, judged.from.pixels());
    EXPECT_FALSE(refused([&](RasterOutputs& got) { got.alpha[fragile] += 0.004; }));
    EXPECT_TRUE(refused([&](RasterOutputs& got) { got.alpha[fragile] += 0.1; }));
}

TEST(RasterCompare, FindsDefectsOfGradients) {
    Judged judged(random_scene({300, 70, 50}, 51), kRasterModes[0]);
    const auto refused = [&](const std::function<void(RasterGradients&)>& damage) {
        RasterGradients got = judged.gradients;
        EXPECT_TRUE(gradients_match(got, judged.gradients, judged.subject));
        damage(got);
        return !gradients_match(got, judged.gradients, judged.subject);
    };
    const auto largest = [](const std::vector<double>& values) {
        double most = 0;
        for (const double value : values) most = std::max(most, std::abs(value));
        return most;
    };
    const double means = largest(judged.gradients.means);
    EXPECT_TRUE(refused([&](RasterGradients& got) { got.means[5] += 3e-5 * means; }));
    EXPECT_FALSE(refused([&](RasterGradients& got) { got.means[5] += 1e-5 * means; }));
    EXPECT_TRUE(refused([](RasterGradients& got) { got.rotations[5] = std::nan(""); }));
    EXPECT_TRUE(refused([](RasterGradients& got) { got.twist.pop_back(); }));
    EXPECT_TRUE(refused([](RasterGradients& got) { got = {}; }));
    // The float32 reference is off by 1e-4 in one tensor: 4e-4 is allowed there, and nothing
    // elsewhere.
    RasterGradients in_float = judged.gradients;
    in_float.means[9] += 1e-4 * means;
    RasterGradients got = judged.gradients;
    got.means[5] += 3e-4 * means;
    EXPECT_FALSE(gradients_match(got, judged.gradients, judged.subject));
    judged.subject.in_float = &in_float;
    EXPECT_TRUE(gradients_match(got, judged.gradients, judged.subject));
    EXPECT_TRUE(refused([&](RasterGradients& more) { more.means[5] += 5e-4 * means; }));
    EXPECT_TRUE(refused(
        [&](RasterGradients& more) { more.scales[5] += 3e-4 * largest(judged.gradients.scales); }));
    in_float.means[9] = std::numeric_limits<double>::infinity();
    EXPECT_FALSE(gradients_match(got, judged.gradients, judged.subject)) << "allows nothing";
    judged.subject.in_float = nullptr;
    judged.subject.hostile.assign(300, false);
    judged.subject.hostile[7] = true;
    EXPECT_FALSE(gradients_match(judged.gradients, judged.gradients, judged.subject))
        << "a gradient of a hostile Gaussian";
}

/// Each quirk of the original gradient exceeds the tolerance, so that the two cannot be confused.
TEST(RasterCompare, TellsTheOriginalGradientFromTheTrueOne) {
    for (const RasterCase& scene :
         {opaque_scene({200, 50, 38}, 57), wide_scene({60, 60, 47}, 58)}) {
        const Judged judged(scene, kRasterModes[0]);
        const auto original =
            reference_scene<double>(scene, kRasterModes[0], ref::RasterGradient::kOriginal);
        EXPECT_FALSE(gradients_match(reference_gradients(original, judged.loss), judged.gradients,
                                     judged.subject));
    }
}

}  // namespace
}  // namespace splat::test

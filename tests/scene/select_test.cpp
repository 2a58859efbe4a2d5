#include "scene/select.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "io/sample_scene.h"
#include "scene/activate.h"
#include "scene/arrays.h"
#include "scene/statistics.h"
#include "support/expect_status.h"

namespace splat::scene {
namespace {

using test::sample_scene;

constexpr float kNanF = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// n Gaussians on the x axis at 0, 1, 2, ...
Gaussians row_of(std::size_t count) {
    Gaussians g = sample_scene(count, 1);
    for (std::size_t i = 0; i < count; ++i) {
        g.means[i * 3] = static_cast<float>(i);
        g.means[i * 3 + 1] = g.means[i * 3 + 2] = 0;
    }
    return g;
}

TEST(Activate, OpacitiesAreThoseOfTheSigmoid) {
    EXPECT_EQ(opacity_of(0), 0.5);
    EXPECT_DOUBLE_EQ(opacity_of(3), 1 / (1 + std::exp(-3.0)));
    EXPECT_GT(opacity_of(-100), 0);
    EXPECT_EQ(opacity_of(100), 1);
}

TEST(Activate, LogitsComeBack) {
    for (const float logit : sample_scene(100, 2).opacity_logits) {
        const auto wide = static_cast<double>(logit);
        EXPECT_NEAR(logit_of(opacity_of(wide)), wide, 1e-12);
    }
}

TEST(Activate, LogitsAreClampedAndOthersAreNone) {
    EXPECT_EQ(logit_of(0), -40);
    EXPECT_EQ(logit_of(1), 40);
    for (const double none : {1.5, -0.1, std::numeric_limits<double>::quiet_NaN()})
        EXPECT_TRUE(std::isnan(logit_of(none))) << none;
}

TEST(Select, CropKeepsTheFacesAndTheOrder) {
    Gaussians g = row_of(6);
    g.means[3 * 3 + 1] = kNanF;
    const auto cropped = need(crop(g, {{1, -1, -1}, {4, 1, 1}}));
    ASSERT_EQ(cropped.count(), 3U);
    EXPECT_EQ(cropped.means[0], 1.0F);
    EXPECT_EQ(cropped.means[6], 4.0F);
    EXPECT_EQ(cropped.sh[12], g.sh[2 * 12]);
    EXPECT_ERROR(crop(g, {{1, 0, 0}, {0, 1, 1}}), Code::kInvalidArgument, "axis x");
    g.sh.pop_back();
    EXPECT_ERROR(crop(g, {{0, 0, 0}, {1, 1, 1}}), Code::kInvalidArgument, "'sh'");
}

TEST(Select, CropSphereKeepsTheSurfaceAndTheOrder) {
    Gaussians g = row_of(6);
    g.means[3 * 3 + 1] = kNanF;
    const auto cropped = need(crop_sphere(g, {3, 0, 0}, 2));
    ASSERT_EQ(cropped.count(), 4U);
    EXPECT_EQ(cropped.means[0], 1.0F);
    EXPECT_EQ(cropped.means[9], 5.0F);
    EXPECT_EQ(cropped.sh[12], g.sh[2 * 12]);
    EXPECT_EQ(need(crop_sphere(g, {4, 0, 0}, 0)).means, (std::vector<float>{4, 0, 0}));
    EXPECT_EQ(need(crop_sphere(g, {4, 0, 3}, 2.9)).count(), 0U);
    EXPECT_ERROR(crop_sphere(g, {0, 0, 0}, -1), Code::kInvalidArgument, "radius -1");
    const double nan = static_cast<double>(kNanF);
    EXPECT_ERROR(crop_sphere(g, {0, 0, 0}, nan), Code::kInvalidArgument, "expected >= 0");
    EXPECT_ERROR(crop_sphere(g, {0, nan, 0}, 1), Code::kInvalidArgument, "centre");
    g.sh.pop_back();
    EXPECT_ERROR(crop_sphere(g, {0, 0, 0}, 1), Code::kInvalidArgument, "'sh'");
}

TEST(Select, FilterByOpacity) {
    Gaussians g = row_of(4);
    g.opacity_logits = {-1, 0, kNanF, kInfinity};
    EXPECT_EQ(need(filter_by_opacity(g, 0.5)).opacity_logits, (std::vector<float>{0, kInfinity}));
    EXPECT_FALSE(filter_by_opacity(g, 1.5).ok());
}

TEST(Select, RemoveInvalid) {
    Gaussians g = row_of(6);
    g.means[1 * 3] = kNanF;
    g.opacity_logits[0] = kInfinity;  // an opacity of 1
    g.opacity_logits[2] = kNanF;
    for (std::size_t k = 0; k < 4; ++k) g.rotations[3 * 4 + k] = 0;
    g.sh[4 * 12 + 11] = -kInfinity;
    const auto kept = need(remove_invalid(g));
    EXPECT_EQ(kept.count(), 2U);
    EXPECT_EQ(kept.means[3], 5.0F);
}

TEST(Select, MergePadsTheLowerDegree) {
    const auto a = sample_scene(2, 0);
    const auto b = sample_scene(3, 2);
    const auto all = need(merge({a, b}));
    EXPECT_OK(check_arrays(all));
    EXPECT_EQ(all.count(), 5U);
    EXPECT_EQ(all.sh_degree, 2U);
    EXPECT_EQ(all.sh[27], a.sh[3]);
    EXPECT_EQ(all.sh[27 + 3], 0.0F);
    EXPECT_EQ(all.sh[2 * 27 + 26], b.sh[26]);
    EXPECT_EQ(need(merge({})).count(), 0U);
}

TEST(Select, MortonOrderBringsNeighboursTogether) {
    Gaussians g = row_of(5);
    const float xs[] = {7, 0, 6, kNanF, 1};
    for (std::size_t i = 0; i < 5; ++i) g.means[i * 3] = xs[i];
    const auto sorted = need(sort_morton(g));
    EXPECT_EQ(sorted.means[0], 0.0F);
    EXPECT_EQ(sorted.means[3], 1.0F);
    EXPECT_EQ(sorted.means[6], 6.0F);
    EXPECT_EQ(sorted.means[9], 7.0F);
    EXPECT_TRUE(std::isnan(sorted.means[12]));
    EXPECT_EQ(sorted.opacity_logits[0], g.opacity_logits[1]);
}

TEST(Statistics, MeasuresAndCounts) {
    Gaussians g = row_of(21);
    g.opacity_logits.assign(21, 0.0F);
    g.opacity_logits[1] = -10;
    g.means[20 * 3 + 2] = kInfinity;
    g.rotations[8] = kNanF;
    g.log_scales[5] = -std::numeric_limits<float>::infinity();
    const Statistics s = need(statistics(g));
    EXPECT_EQ(s.count, 21U);
    EXPECT_EQ(s.bounds.low, (Vec3{0, 0, 0}));
    EXPECT_EQ(s.bounds.high, (Vec3{19, 0, 0}));
    EXPECT_EQ(s.center[0], 9);
    EXPECT_EQ(s.radius, 9);
    EXPECT_EQ(s.opacities.max, 0.5);
    EXPECT_NEAR(s.opacities.mean, (20 * 0.5 + 4.54e-5) / 21, 1e-6);
    EXPECT_EQ(s.non_finite, 3U);
    EXPECT_EQ(s.means.non_finite, 1U);
    EXPECT_EQ(s.bad_rotations, 1U);
    EXPECT_EQ(s.degenerate, 1U);
    EXPECT_EQ(s.invisible, 1U);
    EXPECT_EQ(need(statistics({})).radius, 0);
}

TEST(Arrays, DegreesChangeInPlace) {
    const Gaussians before = sample_scene(3, 2);
    Gaussians g = before;
    set_sh_degree(g, 3);
    EXPECT_OK(check_arrays(g));
    EXPECT_EQ(g.sh[48 + 26], before.sh[27 + 26]);
    EXPECT_EQ(g.sh[48 + 27], 0.0F);
    set_sh_degree(g, 0);
    EXPECT_OK(check_arrays(g));
    EXPECT_EQ(g.sh[5], before.sh[27 + 2]);
    EXPECT_EQ(g.means, before.means);
}

TEST(Statistics, FillRatioIsTheMeanNumberOfLayers) {
    // 101 along each axis, of scales 1, 0.1 and 0.01: 98 % of them lie within 98 of 100 units.
    Gaussians g = row_of(101);
    for (std::size_t i = 0; i < 101; ++i) {
        g.means[3 * i + 1] = g.means[3 * i + 2] = static_cast<float>(i);
        for (std::size_t k = 0; k < 3; ++k)
            g.log_scales[3 * i + k] = static_cast<float>(-std::log(10.0) * static_cast<double>(k));
    }
    EXPECT_NEAR(need(statistics(g)).fill_ratio, 101 * std::numbers::pi * 0.1 / (98 * 98), 1e-8);
    g.log_scales[0] = kNanF;  // an unknown area
    EXPECT_NEAR(need(statistics(g)).fill_ratio, 100 * std::numbers::pi * 0.1 / (98 * 98), 1e-8);
    g.log_scales[0] = -kInfinity;  // flat
    EXPECT_NEAR(need(statistics(g)).fill_ratio, std::numbers::pi * (10 + 0.001) / (98 * 98), 1e-8);
    g.log_scales[0] = kInfinity;
    EXPECT_EQ(need(statistics(g)).fill_ratio, INFINITY);
    // Gaussians at one place are as many layers as Gaussians of the median size.
    g.log_scales.assign(303, -1);
    g.means.assign(303, 2);
    EXPECT_NEAR(need(statistics(g)).fill_ratio, 101, 1e-9);
    EXPECT_EQ(need(statistics({})).fill_ratio, 0);
}

TEST(Statistics, CountsBytesAndBands) {
    Gaussians g = sample_scene(5, 1);
    EXPECT_EQ(need(statistics(g)).bytes, 5U * 4 * (3 + 3 + 4 + 1 + 12));
    for (std::size_t i = 0; i < g.sh.size(); ++i) g.sh[i] = i % 12 < 3 ? 1 : 0;
    EXPECT_EQ(need(statistics(g)).bands.magnitude(), 0);
    g.sh[7] = -2;
    EXPECT_EQ(need(statistics(g)).bands.magnitude(), 2);
}

}  // namespace
}  // namespace splat::scene

#include "prior_scores/information_fidelity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/expect_status.h"
#include "support/golden_file.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

using prior_scores::FidelityOptions;
using prior_scores::information_fidelity;

constexpr FidelityOptions kPublished = {1, true};

/// An image followed by an alpha of ones.
std::vector<float> with_alpha(std::vector<float> image, std::size_t pixels) {
    image.resize(image.size() + pixels, 1);
    return image;
}

TEST(GoldenNetInformationFidelity, OfBothRanges) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    each_golden("prior", [&](const Golden& golden) {
        const std::vector<float> p = golden.floats("vif.pred"), t = golden.floats("vif.gt");
        const std::uint32_t height = golden.dim("vif.gt", 1), width = golden.dim("vif.gt", 2);
        const auto published = need(information_fidelity(p, t, 3, height, width, kPublished));
        const auto scores = need(information_fidelity(p, t, 3, height, width));
        const std::vector<double> expected = golden.doubles("vif.channels64");
        for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(published.channels[c], expected[c], 1e-12);
        EXPECT_NEAR(published.vif, golden.doubles("vif.mean64")[0], 1e-12);
        EXPECT_NEAR(published.vif, golden.doubles("vif.mean")[0], 1e-6) << "computed in float32";
        EXPECT_NEAR(scores.vif, golden.doubles("vif.mean255")[0], 1e-12);
    });
}

TEST(GoldenNetInformationFidelity, TheConstantAlphaIsAveragedInAsPublished) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    each_golden("prior", [&](const Golden& golden) {
        const std::uint32_t height = golden.dim("vif.gt", 1), width = golden.dim("vif.gt", 2);
        const std::size_t pixels = std::size_t{height} * width;
        const auto p = with_alpha(golden.floats("vif.pred"), pixels);
        const auto t = with_alpha(golden.floats("vif.gt"), pixels);
        const auto published = need(information_fidelity(p, t, 4, height, width, kPublished));
        EXPECT_NEAR(published.vif, (3 * golden.doubles("vif.mean64")[0] + 1) / 4, 1e-12);
        const auto scores = need(information_fidelity(p, t, 4, height, width, {1, false}));
        EXPECT_NEAR(scores.vif, golden.doubles("vif.mean64")[0], 1e-12);
        EXPECT_EQ(scores.channels.size(), 3U);
        EXPECT_EQ(scores.constant, 0U);
    });
}

TEST(InformationFidelity, EqualImagesHaveAllOfIt) {
    const std::vector<float> image = normal_fill(2 * 41 * 47, 1, 0.5, 0.2);
    const auto scores = need(information_fidelity(image, image, 2, 41, 47, {255, true}));
    EXPECT_NEAR(scores.vif, 1, 1e-9) << "the variance has 1e-10 in its denominator";
}

TEST(InformationFidelity, NoiseLosesSomeAndAConstantAll) {
    const std::vector<float> image = normal_fill(45 * 43, 1, 0.5, 0.2);
    std::vector<float> noisy = image;
    const std::vector<float> noise = normal_fill(45 * 43, 2, 0, 0.1);
    for (std::size_t i = 0; i < noisy.size(); ++i) noisy[i] += noise[i];
    const auto some = need(information_fidelity(noisy, image, 1, 45, 43));
    const auto none =
        need(information_fidelity(std::vector<float>(45 * 43, 0.5F), image, 1, 45, 43));
    EXPECT_GT(some.vif, 0.05);
    EXPECT_LT(some.vif, 0.9);
    EXPECT_EQ(none.vif, 0);
}

TEST(InformationFidelity, AConstantTruthHasNone) {
    const std::vector<float> constant(2 * 41 * 41, 0.3F);
    std::vector<float> half = constant;  // the second channel is constant
    const std::vector<float> first = normal_fill(41 * 41, 1, 0.5, 0.2);
    std::copy(first.begin(), first.end(), half.begin());
    const auto none = need(information_fidelity(half, constant, 2, 41, 41, {255, false}));
    EXPECT_TRUE(std::isnan(none.vif));
    EXPECT_EQ(none.constant, 1U) << "of one channel; the second is alpha";
    const auto one = need(information_fidelity(half, half, 2, 41, 41, {255, true}));
    EXPECT_NEAR(one.vif, 1, 1e-9);
    EXPECT_EQ(one.constant, 0U) << "equal and constant alphas count as 1";
    std::vector<float> other = half;
    other.back() = 1;
    const auto left_out = need(information_fidelity(other, half, 2, 41, 41, {255, true}));
    EXPECT_EQ(left_out.constant, 1U);
    EXPECT_TRUE(std::isnan(left_out.channels[1]));
    EXPECT_NEAR(left_out.vif, 1, 1e-9);
}

TEST(InformationFidelity, RefusesWhatCannotBeCompared) {
    std::vector<float> image = normal_fill(41 * 41, 1, 0.5, 0.2);
    EXPECT_ERROR(information_fidelity(image, image, 1, 40, 41), Code::kShape,
                 "41 x 40 pixels, expected at least 41 x 41");
    EXPECT_ERROR(information_fidelity(std::vector<float>{1}, std::vector<float>{1}, 1, 1, 1),
                 Code::kShape, "at least 41");
    EXPECT_ERROR(information_fidelity(image, image, 2, 41, 41), Code::kShape, "expected 3362");
    const std::vector<float> good = image;
    image[7] = std::numeric_limits<float>::infinity();
    EXPECT_ERROR(information_fidelity(image, good, 1, 41, 41), Code::kInvalidArgument,
                 "the prediction is inf at number 7");
    EXPECT_ERROR(information_fidelity(good, image, 1, 41, 41), Code::kInvalidArgument,
                 "the truth is inf");
}

}  // namespace
}  // namespace splat::test

#include "eval/compare_scores.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/expect_status.h"

namespace splat::eval {
namespace {

/// Objects "o100", "o101", ... with these values.
ScoreTable table(const std::map<std::string, std::vector<double>>& metrics, std::size_t first = 0) {
    ScoreTable made;
    for (const auto& [metric, values] : metrics) {
        for (std::size_t i = 0; i < values.size(); ++i) {
            const std::string name = "o" + std::to_string(100 + first + i);
            made.objects.insert(name);
            if (std::isfinite(values[i])) made.values[metric][name] = values[i];
        }
    }
    list_metrics(made);
    return made;
}

/// 20 different values, `shift` higher.
std::vector<double> values(double shift) {
    std::vector<double> made;
    for (int i = 0; i < 20; ++i) made.push_back(i % 7 + shift * (1 + 0.1 * (i % 3)));
    return made;
}

ScoreComparison compared(const ScoreTable& a, const ScoreTable& b, bool unpaired = false) {
    CompareOptions options;
    options.unpaired = unpaired;
    options.resample.permutations = 1000;
    return need(compare_scores(a, b, options));
}

TEST(CompareScores, HigherIsBetterExceptForLpips) {
    const ScoreComparison up =
        compared(table({{"psnr", values(0)}, {"ssim", values(0)}, {"lpips", values(0)}}),
                 table({{"psnr", values(1)}, {"ssim", values(0)}, {"lpips", values(1)}}));
    ASSERT_EQ(up.metrics.size(), 3U);
    EXPECT_EQ(up.metrics[0].samples.metric, "psnr");
    EXPECT_EQ(up.metrics[0].verdict, Verdict::kBetter);
    EXPECT_EQ(up.metrics[1].verdict, Verdict::kNoDifference);
    EXPECT_EQ(up.metrics[2].verdict, Verdict::kWorse);
    EXPECT_EQ(up.metrics[0].p_holm, 3 * up.metrics[0].comparison.p_permutation);
    EXPECT_EQ(up.note, "");
}

/// The least p of n pairs is 2^(1 - n), of n scores a side 2 / C(2n, n).
TEST(CompareScores, TooFewObjectsAreCalledSo) {
    EXPECT_EQ(least_objects(1, kLevel, false), 6U);
    EXPECT_EQ(least_objects(2, kLevel, false), 7U);
    EXPECT_EQ(least_objects(3, kLevel, false), 7U);
    EXPECT_EQ(least_objects(1, kLevel, true), 4U) << "2 / 70";
    EXPECT_EQ(least_objects(3, kLevel, true), 5U) << "2 / 252";
    for (const bool unpaired : {false, true})
        for (std::size_t metrics = 1; metrics <= 2; ++metrics) {
            const std::size_t least = least_objects(metrics, kLevel, unpaired);
            for (const std::size_t n : {least - 1, least}) {
                std::map<std::string, std::vector<double>> a, b;
                for (std::size_t m = 0; m < metrics; ++m) {
                    a[kMetrics[m]] = std::vector<double>(n, 1);
                    b[kMetrics[m]] = std::vector<double>(n, 2);
                }
                const ScoreComparison found = compared(table(a), table(b), unpaired);
                EXPECT_EQ(found.least, least);
                const bool enough = n == least;
                EXPECT_EQ(found.metrics[0].verdict, enough ? Verdict::kBetter : Verdict::kTooFew)
                    << n << " objects, " << metrics << " metrics";
                EXPECT_EQ(found.metrics[0].p_holm < kLevel, enough);
            }
        }
}

TEST(CompareScores, OtherViewsAreRefused) {
    ScoreTable a = table({{"psnr", values(0)}});
    ScoreTable b = table({{"psnr", values(1)}});
    for (const std::string& name : a.objects) a.views[name] = b.views[name] = 251;
    compared(a, b);
    b.views["o105"] = b.views["o107"] = 20;
    for (const bool unpaired : {false, true})
        EXPECT_ERROR(compare_scores(a, b, {unpaired, {}}), Code::kInvalidArgument,
                     "2 objects are scored in other numbers of views: 'o105' has 251 in A and 20 "
                     "in B");
    ScoreTable apart = table({{"psnr", values(1)}}, 500);  // shares no object with A
    apart.protocol = "1 inputs, 20 novel";
    EXPECT_OK(compare_scores(a, apart, {true, {}}));
    b.views.clear();
    a.protocol = "1 inputs, all novel";
    compared(a, b);
    b.protocol = "1 inputs: 5, all novel";
    EXPECT_ERROR(compare_scores(a, b, {}), Code::kInvalidArgument,
                 "A with '1 inputs, all novel', B with '1 inputs: 5, all novel'");
}

TEST(CompareScores, ObjectsOfOneTableAreLeftOutAndCounted) {
    const ScoreComparison found =
        compared(table({{"psnr", values(0)}}), table({{"psnr", values(1)}}, 5));
    EXPECT_EQ(found.shared, 15U);
    EXPECT_EQ(found.metrics[0].samples.a.size(), 15U);
    EXPECT_EQ(found.metrics[0].samples.a[0], values(0)[5]);
    EXPECT_HAS(found.note, "5 objects of A and 5 of B");
}

/// What survives a failure does not show that it is better.
TEST(CompareScores, ScoresThatAreNotFiniteAreCounted) {
    std::vector<double> failed = values(1);
    for (std::size_t i = 0; i < 10; ++i) failed[i] = NAN;
    for (const bool unpaired : {false, true}) {
        const ScoreComparison found =
            compared(table({{"psnr", values(0)}, {"ssim", values(0)}}),
                     table({{"psnr", failed}, {"ssim", values(1)}}), unpaired);
        EXPECT_EQ(found.shared, 20U);
        EXPECT_EQ(found.metrics[0].samples.b.size(), 10U);
        EXPECT_EQ(found.metrics[0].samples.lacking_a, 0U);
        EXPECT_EQ(found.metrics[0].samples.lacking_b, 10U);
        EXPECT_EQ(found.metrics[0].verdict, Verdict::kNotComparable);
        EXPECT_EQ(found.metrics[1].samples.lacking_b, 0U);
        EXPECT_EQ(found.metrics[1].verdict == Verdict::kBetter, !unpaired);
        EXPECT_EQ(found.note,
                  "psnr: A lacks a finite score of 0 objects that B has, B of 10 that A has; the "
                  "others do not tell which is better");
    }
    // The same objects in both, such as perfect ones: the others can be compared.
    std::vector<double> a = values(0), b = values(1);
    a[3] = b[3] = INFINITY;
    const ScoreComparison found = compared(table({{"psnr", a}}), table({{"psnr", b}}));
    EXPECT_EQ(found.metrics[0].samples.a.size(), 19U);
    EXPECT_EQ(found.metrics[0].verdict, Verdict::kBetter);
    EXPECT_EQ(found.note, "");
}

TEST(CompareScores, OtherObjectsAreNotComparable) {
    const ScoreTable a = table({{"psnr", values(0)}}), b = table({{"psnr", values(3)}}, 50);
    EXPECT_ERROR(compare_scores(a, b, {}), Code::kNotFound, "share no object");
    const ScoreComparison found = compared(a, b, true);
    EXPECT_FALSE(found.comparable);
    EXPECT_LT(found.metrics[0].p_holm, kLevel);
    EXPECT_EQ(found.metrics[0].verdict, Verdict::kNotComparable);
}

TEST(CompareScores, CountsTheObjectsAndImagesThatEachWins) {
    ScoreTable a = table({{"psnr", {1, 2, 3, 4}}, {"lpips", {1, 2, 3, 4}}});
    ScoreTable b = table({{"psnr", {2, 2, 4, 3}}, {"lpips", {2, 2, 4, 3}}});
    a.images["o100"] = {{5, 20, 0.5, 0.1}, {6, 20, 0.5, NAN}, {7, INFINITY, 1, 0}, {9, 1, 1, 1}};
    b.images["o100"] = {{7, 20, 0.5, 0.1}, {5, 21, 0.5, 0.2}, {6, 21, 0.5, 0.2}, {8, 1, 1, 1}};
    a.images["o101"] = {{5, 20, 0.5, 0.1}};
    const ScoreComparison found = compared(a, b);
    const MetricFinding &psnr = found.metrics[0], &lpips = found.metrics[1];
    EXPECT_EQ(psnr.objects.b, 2U);
    EXPECT_EQ(psnr.objects.a, 1U);
    EXPECT_EQ(psnr.objects.ties, 1U);
    EXPECT_EQ(lpips.objects.b, 1U) << "less is better";
    EXPECT_EQ(psnr.images.b, 2U) << "views 5 and 6";
    EXPECT_EQ(psnr.images.a, 1U) << "view 7, which A draws perfectly";
    EXPECT_EQ(psnr.images.ties, 0U) << "views 8 and 9 are of one only";
    EXPECT_EQ(lpips.images.a, 2U);
    EXPECT_EQ(lpips.images.b, 0U) << "view 6 has no distance in A";
    const ScoreComparison unpaired = compared(a, b, true);
    EXPECT_EQ(unpaired.metrics[0].objects.b + unpaired.metrics[0].images.b, 0U);
    EXPECT_TRUE(std::isnan(unpaired.metrics[0].rank.p));
}

TEST(CompareScores, RanksAreCorrectedForTheNumberOfMetrics) {
    const ScoreComparison found = compared(table({{"psnr", values(0)}, {"ssim", values(0)}}),
                                           table({{"psnr", values(1)}, {"ssim", values(0)}}));
    EXPECT_EQ(found.metrics[0].rank_holm, 2 * found.metrics[0].rank.p);
    EXPECT_EQ(found.metrics[1].rank.p, 1);
    EXPECT_EQ(found.note, "") << "equal scores ask for no test";
    std::vector<double> few = values(0);
    for (std::size_t i = 0; i < 4; ++i) few[i] += 1 + static_cast<double>(i);
    EXPECT_HAS(compared(table({{"psnr", values(0)}}), table({{"psnr", few}})).note,
               "psnr: 4 objects differ, and Wilcoxon's test takes 6 or more");
}

TEST(CompareScores, TextHasEveryNumber) {
    const ScoreComparison found = compared(table({{"psnr", {1, 2}}}), table({{"psnr", {2, 3}}}));
    EXPECT_EQ(
        comparison_text(found),
        R"({"a": "", "b": "", "paired": true, "objects_a": 2, "objects_b": 2, )"
        R"("shared_objects": 2, "least_objects": 6, "seed": 0, "permutations": 1000, "bootstraps": 10000, )"
        R"("note": "psnr: 2 objects differ, and Wilcoxon's test takes 6 or more to tell a difference )"
        R"(from chance", "metrics": [)"
        "\n"
        R"( {"metric": "psnr", "mean_a": 1.5, "mean_b": 2.5, "observed_difference": 1.0, )"
        R"("p_permutation": 0.5, "p_parametric": 0.0, "p_holm": 0.5, "ci": [1.0, 1.0], "ci_bca": [1.0, 1.0], )"
        R"("effect_size": null, "n_pairs": 2, "n_a": 2, "n_b": 2, "lacking_a": 0, )"
        R"("lacking_b": 0, "exact": true, "p_wilcoxon": 0.5, )"
        R"("p_wilcoxon_holm": 0.5, "wilcoxon_w": 3.0, "wilcoxon_n": 2, )"
        R"("wilcoxon_exact": true, "wilcoxon_tied": true, "wins_a": 0, "wins_b": 2, "ties": 0, )"
        R"("image_wins_a": 0, "image_wins_b": 0, "image_ties": 0, )"
        R"("verdict": "too few objects"}]})");
}

}  // namespace
}  // namespace splat::eval

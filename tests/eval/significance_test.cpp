// Tests of significance, against closed forms, enumeration and the numbers of another implementation.
#include "eval/significance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "eval/score_table.h"
#include "support/expect_status.h"
#include "support/golden_file.h"
#include "support/real_data.h"

namespace splat::eval {
namespace {

std::vector<double> sample(std::size_t count, double shift, unsigned seed) {
    std::mt19937 engine(seed);
    std::vector<double> values;
    for (std::size_t i = 0; i < count; ++i)
        values.push_back(shift + static_cast<double>(engine() % 1000) / 100);
    return values;
}

TEST(Significance, StudentIsTheKnownDistribution) {
    // One degree of freedom: 1 - 2/pi atan t; two: 1 - t / sqrt(2 + t^2).
    for (const double t : {0.1, 0.7, 1.0, 3.0, 40.0}) {
        EXPECT_NEAR(student_two_sided(t, 1), 1 - 2 / std::acos(-1.0) * std::atan(t), 1e-12);
        EXPECT_NEAR(student_two_sided(-t, 2), 1 - t / std::sqrt(2 + t * t), 1e-12);
    }
    EXPECT_NEAR(student_two_sided(1.959964, 1e7), 0.05, 1e-6);
    EXPECT_EQ(student_two_sided(0, 5), 1);
}

TEST(Significance, FewPairsAreCountedExactly) {
    const std::vector<double> a = {1, 2, 3, 4, 5};
    const std::vector<double> b = {2, 4, 6, 8, 10};
    const Comparison c = compare_paired(a, b);
    EXPECT_TRUE(c.exact);
    EXPECT_EQ(c.difference, 3);
    EXPECT_EQ(c.p_permutation, 2.0 / 32) << "all signs alike";
    EXPECT_NEAR(c.effect, 3 / std::sqrt(2.5), 1e-12);
    EXPECT_NEAR(c.p_parametric, student_two_sided(3 / std::sqrt(0.5), 4), 1e-12);
    EXPECT_GT(c.low, 1);
    EXPECT_LT(c.high, 5);
    // d = 1, -1, 3: sums of absolute value 3 or more of the eight: 5, 3, 3 and their negatives.
    EXPECT_EQ(
        compare_paired(std::vector<double>{0, 0, 0}, std::vector<double>{1, -1, 3}).p_permutation,
        0.75);
}

TEST(Significance, RandomFlipsTendToTheExactNumber) {
    const std::vector<double> a = sample(20, 0, 1);
    const std::vector<double> b = sample(20, 1.2, 2);
    const double exact = compare_paired(a, b).p_permutation;
    std::vector<double> more_a = a;
    std::vector<double> more_b = b;
    more_a.push_back(1);  // a pair without difference changes no sum, but 21 pairs are drawn
    more_b.push_back(1);
    const Comparison drawn = compare_paired(more_a, more_b);
    EXPECT_FALSE(drawn.exact);
    // Five standard deviations of 300000 draws.
    EXPECT_NEAR(drawn.p_permutation, exact, 5 * std::sqrt(exact * (1 - exact) / 300000));
    EXPECT_EQ(drawn.p_permutation, compare_paired(more_a, more_b).p_permutation) << "the same seed";
    EXPECT_NE(drawn.p_permutation, compare_paired(more_a, more_b, {.seed = 1}).p_permutation);
}

/// A probability from random draws is at least that of the observed signs, which are one of the draws.
TEST(Significance, NoNumberOfFlipsProvesADifference) {
    ResampleOptions options{.permutations = 100};
    const std::vector<double> a(40, 0.0);
    const std::vector<double> b(40, 1.0);
    EXPECT_EQ(compare_paired(a, b, options).p_permutation, 1.0 / 101);
}

/// Like scipy.stats.ttest_rel: t is infinite.
TEST(Significance, EqualDifferencesAreAsFarFromChanceAsCanBe) {
    const std::vector<double> a = {20.1, 21.7, 22.3, 24.9}, b = {20.6, 22.2, 22.8, 25.4};
    const Comparison better = compare_paired(a, b);
    EXPECT_NEAR(better.difference, 0.5, 1e-12);
    EXPECT_EQ(better.p_parametric, 0);
    EXPECT_EQ(better.effect, INFINITY);
    EXPECT_EQ(better.p_permutation, 2.0 / 16);
    EXPECT_EQ(compare_paired(b, a).effect, -INFINITY);
    const std::vector<double> ones(5, 1.0), twos(5, 2.0);
    EXPECT_EQ(compare_pooled(ones, twos).p_parametric, 0);
    EXPECT_EQ(compare_pooled(ones, twos).effect, INFINITY);
    const Comparison one = compare_paired(std::vector<double>{20}, std::vector<double>{21});
    EXPECT_EQ(one.difference, 1);
    EXPECT_EQ(one.p_permutation, 1);
    for (const double value :
         {one.p_parametric, one.effect, one.low, one.high, one.bca_low, one.bca_high})
        EXPECT_TRUE(std::isnan(value)) << "of one pair nothing is known";
}

TEST(Significance, EqualScoresShowNoDifference) {
    const std::vector<double> a = sample(30, 0, 3);
    const Comparison paired = compare_paired(a, a);
    EXPECT_EQ(paired.p_permutation, 1);
    EXPECT_EQ(paired.p_parametric, 1);
    EXPECT_EQ(paired.effect, 0);
    const std::vector<double> even(30, 2.5);
    EXPECT_EQ(compare_pooled(even, even).p_parametric, 1);
    EXPECT_EQ(compare_pooled(even, even).p_permutation, 1);
    EXPECT_EQ(compare_pooled(std::vector<double>{20}, std::vector<double>{20}).p_permutation, 1);
    EXPECT_EQ(compare_paired({}, {}).p_permutation, 1);
}

/// scipy.stats.bootstrap(method="BCa") of 10^6 samples, three seeds of which differ by less than the bounds; its
/// percentiles of the pairs are 0.54 to 3.64.
TEST(Significance, SkewedDifferencesMoveTheAcceleratedInterval) {
    const std::vector<double> zeros(10, 0.0);
    const std::vector<double> skewed = {0.1, 0.4, 0.2, 3.5, 0.7, 1.1, 0.3, 9.0, 0.6, 2.2};
    ResampleOptions options{.permutations = 100, .bootstraps = 400000};
    const Comparison paired = compare_paired(zeros, skewed, options);
    EXPECT_NEAR(paired.low, 0.54, 0.015);
    EXPECT_NEAR(paired.high, 3.64, 0.03);
    EXPECT_NEAR(paired.bca_low, 0.74, 0.02);
    EXPECT_NEAR(paired.bca_high, 4.60, 0.06);
    const Comparison pooled =
        compare_pooled(std::vector<double>{1, 2, 2.5, 3, 9, 4, 1.5}, skewed, options);
    EXPECT_NEAR(pooled.bca_low, -4.085, 0.06);
    EXPECT_NEAR(pooled.bca_high, 0.865, 0.04);
}

TEST(Significance, AcceleratedIntervalsOfNoDeviationAreTheDifference) {
    const std::vector<double> a = {20.1, 21.7, 22.3, 24.9}, b = {20.6, 22.2, 22.8, 25.4};
    const Comparison equal = compare_paired(a, b);
    EXPECT_NEAR(equal.bca_low, 0.5, 1e-12);
    EXPECT_NEAR(equal.bca_high, 0.5, 1e-12);
    // One sample lies on one side of the difference, which leaves no bias to correct for.
    const Comparison one =
        compare_paired(std::vector<double>{0, 0, 0}, std::vector<double>{1, 2, 9},
                       {.permutations = 1, .bootstraps = 1});
    EXPECT_TRUE(std::isnan(one.bca_low) && std::isnan(one.bca_high));
    EXPECT_EQ(one.low, one.high);
}

TEST(Significance, PooledTestsDoNotDependOnTheOrder) {
    const std::vector<double> low = {20, 21, 22}, high = {30, 31, 32};
    // There are 20 ways to choose three of six; one reaches the difference: 2 / 20 on either side.
    EXPECT_NEAR(compare_pooled(low, high).p_permutation, 0.1, 0.005);
    EXPECT_NEAR(compare_pooled(high, low).p_permutation, 0.1, 0.005);
}

/// p is uniform if there is nothing to find: about 5 of 100 are below 0.05.
TEST(Significance, FindsNothingWhereThereIsNothing) {
    int found = 0;
    ResampleOptions options{.permutations = 2000, .bootstraps = 1};
    for (unsigned i = 0; i < 200; ++i)
        found +=
            compare_paired(sample(25, 0, 2 * i), sample(25, 0, 2 * i + 1), options).p_permutation <
            0.05;
    EXPECT_GE(found, 2) << "mean 10, standard deviation 3";
    EXPECT_LE(found, 20);
}

TEST(Significance, HolmMultipliesByTheRemainingTests) {
    EXPECT_EQ(holm(std::vector<double>{0.01, 0.04, 0.03}), (std::vector<double>{0.03, 0.06, 0.06}));
    EXPECT_EQ(holm(std::vector<double>{0.5, 0.9}), (std::vector<double>{1, 1}));
    EXPECT_TRUE(holm({}).empty());
}

TEST(GoldenNetSignificance, PooledTestsAreTheReferences) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    test::each_golden("prior", [&](const test::Golden& golden) {
        const auto values = [&golden](const char* name) { return golden.doubles(name); };
        const Comparison c = compare_pooled(values("sig.base"), values("sig.comp"));
        EXPECT_NEAR(c.difference, values("sig.diff")[0], 1e-12);
        EXPECT_NEAR(c.p_parametric, values("sig.p_param")[0], 1e-9);
        // Both are counts of 300000: five standard deviations of their difference.
        const double f = values("sig.frac")[0];
        EXPECT_NEAR(c.p_permutation, values("sig.p_perm")[0],
                    5 * 2 * std::sqrt(2 * f * (1 - f) / 300000));
    });
}

/// Published means and p-values of one file against the reference.
struct Published {
    const char* file;
    double mean[3];  ///< psnr, ssim, lpips
    double p[3];     ///< from 300000 permutations
};

constexpr Published kPublished[] = {
    {"depth_only.txt", {24.79612, .92935, .08085}, {.000247, .000273, .0311}},
    {"normals_only.txt", {24.81408, .92955, .08070}, {.000247, .000187, .0369}},
    {"both.txt", {24.85462, .92999, .08068}, {.000100, .000100, .0385}},
    {"r8a8d05.txt", {24.74797, .93099, .06828}, {.00141, .0000600, .0000133}},
    {"r32a16d05.txt", {24.8289, .93085, .0721}, {.000180, 0, .00408}},
    {"r8a8d01.txt", {24.84108, .93095, .07191}, {.000107, .00000670, .00309}},
};

std::vector<double> values_of(const ScoreTable& file, const std::string& metric) {
    std::vector<double> values;
    for (const auto& [name, value] : file.values.at(metric)) values.push_back(value);
    return values;
}

TEST(RealScores, GiveThePublishedNumbers) {
    SPLAT_NEEDS_REAL_DATA();
    const std::string folder = *test::real_data_folder() + "/scores/";
    const auto read = [&folder](const char* name) { return need(read_scores(folder + name)); };
    const ScoreTable reference = read("reference.txt");
    EXPECT_EQ(reference.objects.size(), 704U);
    EXPECT_EQ(reference.metrics, (std::vector<std::string>{"psnr", "ssim", "lpips"}));
    const double base[] = {23.99898, .92284, .07703};
    ResampleOptions options{.permutations = 100000, .bootstraps = 1};
    for (const Published& row : kPublished) {
        const ScoreTable other = read(row.file);
        for (const auto& [name, value] : other.values.at("psnr"))
            EXPECT_EQ(reference.values.at("psnr").count(name), 0U) << "no object is in both";
        for (std::size_t i = 0; i < 3; ++i) {
            const std::string& metric = reference.metrics[i];
            const Comparison c =
                compare_pooled(values_of(reference, metric), values_of(other, metric), options);
            EXPECT_NEAR(c.difference, row.mean[i] - base[i], 6e-5)
                << row.file << " " << metric << ": both means are rounded to 5 digits";
            // Both count rare events: five standard deviations of their difference, and of a count of at
            // least one.
            const double f = std::max(row.p[i] / 2, 1.0 / 300000);
            EXPECT_NEAR(c.p_permutation, row.p[i], 5 * 2 * std::sqrt(f / 300000 + f / 100000))
                << row.file << " " << metric;
        }
    }
}

}  // namespace
}  // namespace splat::eval

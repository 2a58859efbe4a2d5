// Wilcoxon's test against scipy 1.17.1.
#include "eval/signed_rank.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace splat::eval {
namespace {

/// The test of differences.
RankTest of(const std::vector<double>& differences) {
    return signed_rank_test(std::vector<double>(differences.size(), 0.0), differences);
}

TEST(SignedRank, FewDifferencesOfDifferentSizesAreExact) {
    // scipy.stats.wilcoxon(b - a, method="exact"), the example of Hollander and Wolfe 1973.
    const std::vector<double> a = {0.878, 0.647, 0.598, 2.05, 1.06, 1.29, 1.06, 3.14, 1.29};
    const std::vector<double> b = {1.83, 0.50, 1.62, 2.48, 1.68, 1.88, 1.55, 3.06, 1.30};
    const RankTest test = signed_rank_test(a, b);
    EXPECT_EQ(test.p, 0.0390625);
    EXPECT_EQ(test.positive, 40);
    EXPECT_EQ(test.n, 9U);
    EXPECT_TRUE(test.exact);
    EXPECT_FALSE(test.tied);
    EXPECT_EQ(signed_rank_test(b, a).positive, 5);
    EXPECT_EQ(signed_rank_test(b, a).p, test.p);
    for (std::size_t n = 1; n <= 8; ++n) {  // all signs alike are the least that n can show
        std::vector<double> up;
        for (std::size_t i = 0; i < n; ++i) up.push_back(static_cast<double>(i + 1));
        EXPECT_EQ(of(up).p, std::exp2(1 - static_cast<double>(n)));
    }
}

TEST(SignedRank, DifferencesOfZeroAreDropped) {
    const RankTest test = of({0, 3, -1, 4, 0, 6, -2, 8});
    EXPECT_EQ(test.p, 0.15625) << "of the six others";
    EXPECT_EQ(test.n, 6U);
    EXPECT_TRUE(test.exact);
    const RankTest none = of({0, 0});
    EXPECT_EQ(none.p, 1);
    EXPECT_EQ(none.n, 0U);
}

TEST(SignedRank, TiesShareRanksAndReduceTheVariance) {
    std::vector<double> differences = {1, 1, -1, 2, 2, 3, 0, -2, 4, 4, 5, 0};
    const RankTest test = of(differences);
    EXPECT_EQ(test.p, 0.041015625) << "42 of the 1024 signs are as far away";
    EXPECT_EQ(test.positive, 48);
    EXPECT_EQ(test.n, 10U);
    EXPECT_TRUE(test.exact);
    EXPECT_TRUE(test.tied);
    for (std::size_t n = 1; n <= 8; ++n)
        EXPECT_EQ(of(std::vector<double>(n, 0.5)).p, std::exp2(1 - static_cast<double>(n)));
    // zero_method="wilcox", method="approx", correction=False
    std::vector<double> many;
    for (int i = 0; i < 6; ++i) many.insert(many.end(), differences.begin(), differences.end());
    const RankTest normal = of(many);
    EXPECT_NEAR(normal.p, 2.722664539776872e-07, 1e-14);
    EXPECT_EQ(normal.positive, 1608);
    EXPECT_FALSE(normal.exact);
    // 20.6 - 20.1 and 22.2 - 21.7 differ by rounding alone.
    EXPECT_TRUE(
        signed_rank_test(std::vector<double>{20.1, 21.7, 3}, std::vector<double>{20.6, 22.2, 9})
            .tied);
}

TEST(SignedRank, FiftyAreExactAndMoreAreNormal) {
    std::vector<double> differences;
    for (int i = 0; i < 60; ++i) differences.push_back((i * 37 % 61 + 1) * (i % 3 == 0 ? -1 : 1));
    const RankTest many = of(differences);
    EXPECT_FALSE(many.exact);
    EXPECT_FALSE(many.tied);
    EXPECT_NEAR(many.p, 0.02121244381192546, 1e-14);
    EXPECT_EQ(many.positive, 1228);
    differences.resize(50);
    const RankTest fifty = of(differences);
    EXPECT_TRUE(fifty.exact);
    EXPECT_NEAR(fifty.p, 0.020665866669398625, 1e-14);
    EXPECT_EQ(fifty.positive, 876);
}

TEST(Wins, AreCountedInTheMetricsDirection) {
    Wins more, less;
    for (const auto& [a, b] : {std::pair{1.0, 2.0}, {3.0, 4.0}, {2.0, 1.0}, {1.0, 1.0}}) {
        more.count(a, b, false);
        less.count(a, b, true);
    }
    more.count(20, INFINITY, false);  // a perfect image
    more.count(INFINITY, INFINITY, false);
    EXPECT_EQ(more.b, 3U);
    EXPECT_EQ(more.a, 1U);
    EXPECT_EQ(more.ties, 2U);
    EXPECT_EQ(less.b, 1U);
    EXPECT_EQ(less.a, 2U);
}

}  // namespace
}  // namespace splat::eval

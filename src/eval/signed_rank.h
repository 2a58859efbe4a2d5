#pragma once

#include <cstddef>
#include <span>

namespace splat::eval {

/// Wilcoxon's signed rank test of pairs: is B as often as far above A as below?
struct RankTest {
    double p = 1;         ///< two-sided; 1 if no pair differs
    double positive = 0;  ///< W+: sum of the ranks of the differences b - a above 0
    std::size_t n = 0;    ///< differences that are not 0
    bool exact = true;    ///< false: by a normal distribution
    bool tied = false;    ///< differences of equal size share the mean of their ranks
};

/// Differences of 0 are dropped (Wilcoxon's rule, not Pratt's). Up to 50 differences have the exact distribution, given
/// which are of equal size; that of more is approximated by a normal one, with its variance corrected for ties, without
/// a correction for continuity. Sizes are equal within 1e-12 of the largest score, which decimal fractions err by.
/// Source: Wilcoxon 1945; Lehmann, Nonparametrics, 1975, for ties.
RankTest signed_rank_test(std::span<const double> a, std::span<const double> b);

/// Pairs in which one method is better.
struct Wins {
    std::size_t a = 0, b = 0;
    std::size_t ties = 0;  ///< equal scores

    void count(double of_a, double of_b, bool less_is_better);
};

}  // namespace splat::eval

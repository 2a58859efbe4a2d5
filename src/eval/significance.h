#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace splat::eval {

double mean(std::span<const double> values);

/// Is a difference of means more than chance?
struct Comparison {
    double difference = 0;     ///< mean of b minus mean of a
    double p_permutation = 1;  ///< two-sided
    double p_parametric = 1;   ///< NaN of one pair
    /// Percentile bootstrap interval of 95 % of the difference; NaN of one pair.
    double low = 0, high = 0;
    /// The same, bias-corrected and accelerated; NaN also if all bootstrap samples lie on one side of the difference.
    double bca_low = 0, bca_high = 0;
    /// Difference over standard deviation, infinite if that is 0; NaN of one pair.
    double effect = 0;
    bool exact = false;  ///< all permutations were counted
};

struct ResampleOptions {
    std::uint64_t seed = 0;
    std::uint32_t permutations = 300000;
    std::uint32_t bootstraps = 10000;
};

/// Pairs of scores of the same objects.
///
/// p_permutation  signs of the differences are flipped: all 2^n of up to 20 pairs, else at random, where p
///                is (1 + extreme) / (1 + permutations)
/// p_parametric   Student's t of the differences
/// effect         Cohen's d of the differences
/// bca_low, bca_high   BCa of the same bootstrap samples; the acceleration is that of the jackknife, and of samples
///                equal to the difference half count as below it
/// Determinism    the same numbers for the same seed
/// Source         Fisher 1935; Phipson & Smyth 2010 for the 1 +; Efron 1987 for BCa
Comparison compare_paired(std::span<const double> a, std::span<const double> b,
                          const ResampleOptions& options = {});

/// Scores of any objects, as Splatter Image with priors was judged: identities do not count.
///
/// p_permutation  2 min(f, 1 - f), f the part of random splits of all scores with a difference of at
///                least that seen; may be 0
/// p_parametric   the same for means of samples of a normal distribution with a's mean and population
///                standard deviation, of a's size: in closed form, which resampling tends to
/// effect         Cohen's d with the pooled standard deviation
/// bca_low, bca_high   as above; the jackknife leaves out one score of either sample
Comparison compare_pooled(std::span<const double> a, std::span<const double> b,
                          const ResampleOptions& options = {});

/// The least number of pairs, or unpaired of scores of each side, whose least p_permutation, 2^(1 - n) or 2 / C(2n, n),
/// is below `level` after a correction for so many tests.
std::size_t least_objects(std::size_t tests, double level, bool unpaired);

/// Whether n_a and n_b scores (in pairs: as many) are too few for that.
bool too_few(std::size_t n_a, std::size_t n_b, std::size_t tests, double level, bool unpaired);

/// Holm's correction for several tests: adjusted p in the order given. Source: Holm 1979.
std::vector<double> holm(std::span<const double> p);

/// The probability that a Student's t of so many degrees of freedom is further from 0.
double student_two_sided(double t, double degrees);

}  // namespace splat::eval

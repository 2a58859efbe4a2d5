#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "ref/summed.h"
#include "support/tolerances.h"

namespace splat::test {

/// Describes the comparison in the message of a failure.
struct Subject {
    std::string name;             ///< "grad_x"
    std::string reproducer;       ///< one line, see reproduce()
    bool gradient = false;        ///< stricter demand on the share of non-zero elements
    bool zeros_expected = false;  ///< the mathematics gives mostly zeros: no trust check
};

/// "reproduce: <program> --gtest_filter=Suite.Case  (<what>)" of the running test.
std::string reproduce(const std::string& what);

/// ||gpu - ref|| / max(||ref||, ||S / (1 + sqrt(K))||).
///
/// The second norm is that of sums of the same terms with random signs: where the reference is far
/// below it, terms cancel for mathematical reasons (two elements per group, say), and no float32
/// computation is accurate relative to what is left.
double relative_l2(const std::vector<float>& gpu, const ref::Summed<double>& reference);

/// The bound of a float32 sum of K terms of magnitude S.
double bound(double c, std::size_t terms, double magnitude);

/// Every element within c * 2^-24 * (1 + sqrt(K)) * S + tiny, relative L2 within the figure, no
/// NaN, and a reference that can tell right from wrong: not more than 70 % zeros, a gradient at
/// least 10 % non-zero. Otherwise the first mismatch and its reproducer.
testing::AssertionResult matches(const std::vector<float>& gpu,
                                 const ref::Summed<double>& reference, const Tolerance& tolerance,
                                 const Subject& subject);

/// matches() without the figure for the whole tensor: for inputs whose cancellation is the point of
/// the test.
testing::AssertionResult within_bound(const std::vector<float>& gpu,
                                      const ref::Summed<double>& reference,
                                      const Tolerance& tolerance, const Subject& subject);

/// Same bits in every element.
testing::AssertionResult bit_equal(const std::vector<float>& a, const std::vector<float>& b,
                                   const Subject& subject);

/// Equal to the reference as numbers, for inputs whose sums are exact in float32; trust check as in
/// matches().
testing::AssertionResult exact(const std::vector<float>& gpu, const ref::Summed<double>& reference,
                               const Subject& subject);

/// |gpu - expected| <= absolute + relative * |expected| in every element: golden files, which have
/// no magnitudes.
testing::AssertionResult close(const std::vector<float>& gpu, const std::vector<double>& expected,
                               double absolute, double relative, const Subject& subject);

/// No NaN and no infinity.
testing::AssertionResult all_finite(const std::vector<float>& values, const Subject& subject);

/// FNV-1a of the bits: equal tensors, equal hashes.
std::uint64_t bit_hash(const std::vector<float>& values);

}  // namespace splat::test

#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "support/rng_fill.h"

namespace splat::test {

/// Step of the central difference: truncation h^2 and rounding 2^-53 / h are both near 1e-11.
inline constexpr double kGradcheckStep = 1e-5;
/// A hundred times that error, relative to gradients of size 1.
inline constexpr double kGradcheckRelative = 1e-6;
/// Absolute floor for gradients that cancel, with losses up to about 100.
inline constexpr double kGradcheckAbsolute = 1e-8;
inline constexpr std::size_t kGradcheckMost = 10000;

/// `gradient` equals the float64 central difference of `loss` at `x` in every element, or in 10^4 random
/// ones of more.
inline testing::AssertionResult gradcheck(
    const std::string& name, const std::function<double(const std::vector<double>&)>& loss,
    std::vector<double> x, const std::vector<double>& gradient) {
    if (gradient.size() != x.size())
        return testing::AssertionFailure()
               << name << ": " << gradient.size() << " gradients for " << x.size() << " elements";
    Rng rng(x.size());
    const std::size_t count = std::min(x.size(), kGradcheckMost);
    for (std::size_t n = 0; n < count; ++n) {
        const std::size_t i = count == x.size() ? n : rng.below(x.size());
        const double at = x[i];
        x[i] = at + kGradcheckStep;
        const double above = loss(x);
        const double x_above = x[i];
        x[i] = at - kGradcheckStep;
        const double below = loss(x);
        const double numeric = (above - below) / (x_above - x[i]);
        x[i] = at;
        const double allowed = kGradcheckAbsolute + kGradcheckRelative * std::abs(numeric);
        if (!(std::abs(numeric - gradient[i]) <= allowed))
            return testing::AssertionFailure()
                   << name << "[" << i << "]: gradient " << gradient[i] << ", central difference "
                   << numeric << ", allowed difference " << allowed;
    }
    return testing::AssertionSuccess();
}

/// sum a_i * b_i, for losses that are linear in an op's output.
inline double dot(const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
    return sum;
}

}  // namespace splat::test

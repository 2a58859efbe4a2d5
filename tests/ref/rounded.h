#pragma once

#include <algorithm>
#include <cmath>

#include "ref/summed.h"

namespace splat::ref {

/// How far a device may be off: Vulkan's table "Precision of Individual Operations" (appendix A, the environment for
/// SPIR-V) for float32, in roundings of 2^-24 of the result. A unit in the last place is one or two of them: two are
/// taken. Sums and products are correctly rounded: one, to nearest on every driver known.
inline constexpr double kQuotientRoundings = 5;     ///< 2.5 units
inline constexpr double kInverseRootRoundings = 4;  ///< 2 units
/// For sqrt and length, which the table derives from 1 / inversesqrt.
inline constexpr double kRootRoundings = kInverseRootRoundings + kQuotientRoundings;
/// For exp and exp2 of x: 3 + 2 |x| units.
inline double exp_roundings(double x) {
    return 6 + 4 * std::abs(x);
}

/// A float64 value with the magnitude S of Summed (K = 1): what the roundings of a float32 computation
/// of the same expression add up to, to first order and at worst. A reference written for any number
/// type gives values with double and magnitudes with this one; the rules are those of errors in sums,
/// products and quotients, and Vulkan's bound of 3 + 2|x| ulp for exp.
struct Rounded {
    double value = 0;
    double magnitude = 0;

    Rounded() = default;
    Rounded(double exact) : value(exact), magnitude(std::abs(exact)) {}
    Rounded(double v, double m) : value(v), magnitude(m) {}
};

inline Rounded operator-(const Rounded& a) {
    return {-a.value, a.magnitude};
}
inline Rounded operator+(const Rounded& a, const Rounded& b) {
    return {a.value + b.value, a.magnitude + b.magnitude};
}
inline Rounded operator-(const Rounded& a, const Rounded& b) {
    return a + -b;
}
inline Rounded operator*(const Rounded& a, const Rounded& b) {
    return {a.value * b.value, std::abs(a.value) * b.magnitude + std::abs(b.value) * a.magnitude};
}
inline Rounded operator/(const Rounded& a, const Rounded& b) {
    const double quotient = a.value / b.value;
    return {quotient, (a.magnitude + std::abs(quotient) * b.magnitude) / std::abs(b.value)};
}
/// Arguments beyond 300 count as 300: far beyond float32, and the magnitudes stay within float64.
inline Rounded exp(const Rounded& a) {
    const double value = std::exp(std::min(a.value, 300.0));
    return {value, value * (a.magnitude + 3 + 2 * std::abs(a.value))};
}
/// 0 where the argument is 0.
inline Rounded sqrt(const Rounded& a) {
    const double root = std::sqrt(a.value);
    return {root, root > 0 ? root + a.magnitude / (2 * root) : 0};
}
inline double number_of(const Rounded& a) {
    return a.value;
}
inline double number_of(double a) {
    return a;
}

/// `terms`: how many numbers the longest sum in each adds up.
inline Summed<double> summed(const std::vector<Rounded>& numbers, std::size_t terms = 1) {
    Summed<double> result(numbers.size(), terms);
    for (std::size_t i = 0; i < numbers.size(); ++i)
        result.add(i, numbers[i].value, numbers[i].magnitude);
    return result;
}

}  // namespace splat::ref

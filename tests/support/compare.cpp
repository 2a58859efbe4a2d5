#include "support/compare.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>

#include "core/status.h"

namespace splat::test {
namespace {

using testing::AssertionFailure;
using testing::AssertionResult;
using testing::AssertionSuccess;

/// Below the normal range float32 has an absolute spacing; some devices flush it to zero.
constexpr double kTiny = 1.2e-38;
constexpr double kHalfUlp = 0x1p-24;
constexpr double kMostZeros = 0.70;
constexpr double kLeastNonZeroGradient = 0.10;

AssertionResult sizes_match(std::size_t got, std::size_t expected, const Subject& subject) {
    if (got == expected) return AssertionSuccess();
    return AssertionFailure() << subject.name << ": " << got << " elements, the reference has "
                              << expected << "\n  " << subject.reproducer;
}

/// A comparison against zeros proves nothing: it must be able to fail.
AssertionResult can_fail(const std::vector<double>& reference, const Subject& subject) {
    if (subject.zeros_expected) return AssertionSuccess();
    if (reference.empty()) return AssertionFailure() << subject.name << ": mistrusted, no elements";
    const auto zeros = static_cast<double>(std::count(reference.begin(), reference.end(), 0.0));
    const double share = zeros / static_cast<double>(reference.size());
    if (share > kMostZeros || (subject.gradient && 1 - share < kLeastNonZeroGradient))
        return AssertionFailure() << subject.name << ": mistrusted, "
                                  << format("%.0f %% of the reference is zero\n  ", share * 100)
                                  << subject.reproducer;
    return AssertionSuccess();
}

using Allowed = std::function<double(std::size_t)>;

/// |gpu - reference| <= allowed(i) for all i; a NaN never is.
AssertionResult elements_match(const std::vector<float>& gpu, const std::vector<double>& reference,
                               const Allowed& allowed, const Subject& subject) {
    if (AssertionResult same = sizes_match(gpu.size(), reference.size(), subject); !same)
        return same;
    std::size_t first = gpu.size();
    std::size_t count = 0;
    for (std::size_t i = 0; i < gpu.size(); ++i) {
        const double difference = std::abs(static_cast<double>(gpu[i]) - reference[i]);
        if (difference <= allowed(i)) continue;
        first = std::min(first, i);
        ++count;
    }
    if (count == 0) return AssertionSuccess();
    const auto got = static_cast<double>(gpu[first]);
    return AssertionFailure() << subject.name
                              << format(
                                     "[%zu] = %.9g, reference %.17g: off by %.3g, bound %.3g "
                                     "(%zu of %zu elements differ)\n  ",
                                     first, got, reference[first], std::abs(got - reference[first]),
                                     allowed(first), count, gpu.size())
                              << subject.reproducer;
}

}  // namespace

std::string reproduce(const std::string& what) {
    const auto* unit = testing::UnitTest::GetInstance();
    const auto* info = unit->current_test_info();
    if (info == nullptr) return "reproduce: " + what;
    return std::string("reproduce: --gtest_filter=") + info->test_suite_name() + "." +
           info->name() + "  (" + what + ")";
}

double bound(double c, std::size_t terms, double magnitude) {
    return c * kHalfUlp * (1 + std::sqrt(static_cast<double>(terms))) * magnitude + kTiny;
}

double relative_l2(const std::vector<float>& gpu, const ref::Summed<double>& reference) {
    const double root = 1 + std::sqrt(static_cast<double>(reference.terms));
    double error = 0;
    double norm = 0;
    double random_norm = 0;
    for (std::size_t i = 0; i < gpu.size(); ++i) {
        const double difference = static_cast<double>(gpu[i]) - reference.value[i];
        const double random = reference.magnitude[i] / root;
        error += difference * difference;
        norm += reference.value[i] * reference.value[i];
        random_norm += random * random;
    }
    const double scale = std::max(norm, random_norm);
    return scale > 0 ? std::sqrt(error / scale) : std::sqrt(error);
}

AssertionResult within_bound(const std::vector<float>& gpu, const ref::Summed<double>& reference,
                             const Tolerance& tolerance, const Subject& subject) {
    const auto allowed = [&](std::size_t i) {
        return bound(tolerance.c, reference.terms, reference.magnitude[i]);
    };
    if (AssertionResult close_enough = elements_match(gpu, reference.value, allowed, subject);
        !close_enough)
        return close_enough;
    return can_fail(reference.value, subject);
}

AssertionResult matches(const std::vector<float>& gpu, const ref::Summed<double>& reference,
                        const Tolerance& tolerance, const Subject& subject) {
    if (AssertionResult close_enough = within_bound(gpu, reference, tolerance, subject);
        !close_enough)
        return close_enough;
    const double error = relative_l2(gpu, reference);
    if (error <= tolerance.relative_l2) return AssertionSuccess();
    return AssertionFailure() << subject.name
                              << format(": relative L2 error %.3g, allowed %.3g\n  ", error,
                                        tolerance.relative_l2)
                              << subject.reproducer;
}

AssertionResult bit_equal(const std::vector<float>& a, const std::vector<float>& b,
                          const Subject& subject) {
    if (AssertionResult same = sizes_match(a.size(), b.size(), subject); !same) return same;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const auto left = std::bit_cast<std::uint32_t>(a[i]);
        const auto right = std::bit_cast<std::uint32_t>(b[i]);
        if (left != right)
            return AssertionFailure()
                   << subject.name
                   << format("[%zu]: bits %08x (%.9g) and %08x (%.9g)\n  ", i, left,
                             static_cast<double>(a[i]), right, static_cast<double>(b[i]))
                   << subject.reproducer;
    }
    return AssertionSuccess();
}

AssertionResult exact(const std::vector<float>& gpu, const ref::Summed<double>& reference,
                      const Subject& subject) {
    const auto nothing = [](std::size_t) { return 0.0; };
    if (AssertionResult same = elements_match(gpu, reference.value, nothing, subject); !same)
        return same;
    return can_fail(reference.value, subject);
}

AssertionResult close(const std::vector<float>& gpu, const std::vector<double>& expected,
                      double absolute, double relative, const Subject& subject) {
    const auto allowed = [&](std::size_t i) { return absolute + relative * std::abs(expected[i]); };
    if (AssertionResult same = elements_match(gpu, expected, allowed, subject); !same) return same;
    return can_fail(expected, subject);
}

AssertionResult all_finite(const std::vector<float>& values, const Subject& subject) {
    for (std::size_t i = 0; i < values.size(); ++i)
        if (!std::isfinite(values[i]))
            return AssertionFailure()
                   << subject.name << format("[%zu] = %g\n  ", i, static_cast<double>(values[i]))
                   << subject.reproducer;
    return AssertionSuccess();
}

std::uint64_t bit_hash(const std::vector<float>& values) {
    std::uint64_t hash = 0xcbf29ce484222325ULL;
    for (const float value : values) {
        const auto bits = std::bit_cast<std::uint32_t>(value);
        for (int shift = 0; shift < 32; shift += 8) {
            hash ^= bits >> shift & 0xFFU;
            hash *= 0x100000001b3ULL;
        }
    }
    return hash;
}

}  // namespace splat::test

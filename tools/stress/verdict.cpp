// Comparison of a result with its bound.

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "stress/stress.h"

namespace vkrun::stress {
namespace {

constexpr double kLargestFloat = std::numeric_limits<float>::max();

/// The unit of a tensor's errors: its largest magnitude that float32 has.
double unit_of(const std::vector<double>& values) {
    double largest = 0;
    for (const double value : values)
        if (std::abs(value) <= kLargestFloat) largest = std::max(largest, std::abs(value));
    return largest > 0 ? largest : 1;
}

struct Distance {
    double error;
    double allowed;

    [[nodiscard]] bool beyond() const { return error > allowed; }
};

/// From float64, or, where that is too far, from what a device may give instead.
Distance distance_of(float got, const Expected& expected, std::size_t i) {
    const auto from = [&](double value, double allowed) {
        return Distance{std::abs(static_cast<double>(got) - value), allowed};
    };
    const Distance distance = from(expected.value[i], expected.allowed[i]);
    if (!distance.beyond() || expected.other.empty()) return distance;
    const Distance other = from(expected.other[i], expected.other_allowed[i]);
    return other.beyond() ? distance : other;
}

}  // namespace

double Verdict::ratio() const {
    if (non_finite > 0) return std::numeric_limits<double>::infinity();
    return allowed > 0 ? error / allowed : error > 0 ? std::numeric_limits<double>::infinity() : 0;
}

Verdict judge(const std::vector<float>& got, const Expected& expected) {
    if (got.size() != expected.value.size())
        throw Failure(kFailed, "a result has another number of elements than its reference");
    Verdict verdict;
    verdict.elements = got.size();
    const double unit = unit_of(expected.value);
    double worst = -1;
    for (std::size_t i = 0; i < got.size(); ++i) {
        const double value = expected.value[i];
        const double allowed = expected.allowed[i];
        if (std::isnan(value) || std::isnan(allowed)) {
            ++verdict.unjudged;
            continue;
        }
        const double largest =
            std::max(std::abs(value), expected.largest.empty() ? 0 : expected.largest[i]) + allowed;
        if (!std::isfinite(got[i])) {
            if (largest <= kLargestFloat) ++verdict.non_finite;
            continue;
        }
        if (std::isinf(value)) {
            ++verdict.wrong;
            continue;
        }
        const Distance distance = distance_of(got[i], expected, i);
        if (distance.beyond()) ++verdict.wrong;
        const double ratio = distance.allowed > 0 ? distance.error / distance.allowed
                             : distance.beyond()  ? 1e300
                                                  : 0;
        if (ratio <= worst) continue;
        worst = ratio;
        verdict.error = distance.error / unit;
        verdict.allowed = distance.allowed / unit;
    }
    return verdict;
}

double peer_error(const std::vector<float>& got, const Expected& expected) {
    const Verdict verdict = judge(got, expected);
    return verdict.non_finite > 0 ? std::numeric_limits<double>::infinity() : verdict.error;
}

std::size_t count_unequal(const std::vector<float>& a, const std::vector<float>& b) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
        if (std::bit_cast<std::uint32_t>(a[i]) != std::bit_cast<std::uint32_t>(b[i])) ++count;
    return count;
}

float beyond_bound(const Expected& expected) {
    double most = expected.value[0] + 2 * expected.allowed[0];
    if (!expected.other.empty())
        most = std::max(most, expected.other[0] + 2 * expected.other_allowed[0]);
    return static_cast<float>(most + 1e-3 * unit_of(expected.value));
}

}  // namespace vkrun::stress

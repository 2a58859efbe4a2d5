#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace splat::ref {

/// What a tensor holds: NaN and infinite elements counted, the rest summed up.
struct TensorStats {
    double min = std::numeric_limits<double>::infinity();   ///< smallest finite element
    double max = -std::numeric_limits<double>::infinity();  ///< largest finite element
    double mean = 0;            ///< mean of the finite elements; 0 without any
    double mean_magnitude = 0;  ///< mean of |x|: the S of the mean's bound
    std::uint64_t finite_count = 0;
    std::uint64_t nan_count = 0;
    std::uint64_t inf_count = 0;
};

template <class Real>
TensorStats tensor_stats(const std::vector<Real>& x) {
    TensorStats stats;
    double sum = 0;
    double sum_magnitude = 0;
    for (const Real element : x) {
        if (std::isnan(element)) {
            ++stats.nan_count;
        } else if (std::isinf(element)) {
            ++stats.inf_count;
        } else {
            const auto value = static_cast<double>(element);
            ++stats.finite_count;
            stats.min = std::min(stats.min, value);
            stats.max = std::max(stats.max, value);
            sum += value;
            sum_magnitude += std::abs(value);
        }
    }
    if (stats.finite_count > 0) {
        stats.mean = sum / static_cast<double>(stats.finite_count);
        stats.mean_magnitude = sum_magnitude / static_cast<double>(stats.finite_count);
    }
    return stats;
}

}  // namespace splat::ref

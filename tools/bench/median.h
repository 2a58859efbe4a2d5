#pragma once

#include <algorithm>
#include <vector>

namespace vkrun::bench {

/// The middle one of the sorted values, or the mean of the middle two; 0 without values.
inline double median_of(std::vector<double> values) {
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    const std::size_t middle = values.size() / 2;
    return values.size() % 2 == 1 ? values[middle] : (values[middle - 1] + values[middle]) / 2;
}

}  // namespace vkrun::bench

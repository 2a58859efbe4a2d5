#pragma once

#include <cstdint>
#include <span>

namespace splat::train {

/// The scales s outside the range that CO3D's terms hold: how many, and what these terms take the means of.
struct ScaleOutliers {
    std::uint64_t large = 0, small = 0;
    double large_sum = 0;  ///< sum of s
    double small_sum = 0;  ///< sum of -ln s

    [[nodiscard]] bool any() const { return large + small > 0; }
    void add(std::span<const float> scales);
    void add(const ScaleOutliers& others);

    /// 0.1 mean(s | s > 20) + 0.1 mean(-ln s | s < 1e-5), without a mean of nothing.
    [[nodiscard]] double loss() const;
};

ScaleOutliers sum_of(std::span<const ScaleOutliers> parts);

/// Add the gradients of loss() for some scales of a batch with these outliers: the means are over the batch.
void add_scale_gradients(std::span<const float> scales, const ScaleOutliers& batch,
                         std::span<float> gradients);

}  // namespace splat::train

#pragma once

#include <cstdint>
#include <span>

namespace splat::train {

/// How many scales lie outside the range that CO3D's terms hold.
struct ScaleOutliers {
    std::uint64_t large = 0, small = 0;

    [[nodiscard]] bool any() const { return large + small > 0; }
    void add(std::span<const float> scales);
};

/// Add the gradients of 0.1 mean(s | s > 20) + 0.1 mean(-ln s | s < 1e-5) for some scales s of a batch with
/// these outliers: the means are over the batch.
void add_scale_gradients(std::span<const float> scales, const ScaleOutliers& batch,
                         std::span<float> gradients);

}  // namespace splat::train

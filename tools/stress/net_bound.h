#pragma once

#include <functional>
#include <vector>

#include "stress/network.h"
#include "stress/stress.h"

namespace vkrun::stress {

/// Results of a computation in float64 that starts with an exact run and goes on with noisy ones: of each tensor the
/// exact values, and as the bound the largest change of any of its numbers in a noisy run.
std::vector<Expected> expected_by_noise(
    const std::function<std::vector<Numbers>(NetNoise*)>& compute, int samples);

/// Tensors end to end, each number with the bound of its own tensor.
Expected joined(const std::vector<Expected>& tensors);
std::vector<float> joined(const std::vector<std::vector<float>>& tensors);

extern const char* const kNetReason;

}  // namespace vkrun::stress

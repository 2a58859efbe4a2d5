#include "stress/net_bound.h"

#include <algorithm>
#include <cmath>

namespace vkrun::stress {

const char* const kNetReason =
    "the largest change of the tensor in float64 runs in which every result of every operator "
    "moves by up to what "
    "that operator alone may be off, at random";

std::vector<Expected> expected_by_noise(
    const std::function<std::vector<Numbers>(NetNoise*)>& compute, int samples) {
    std::vector<Expected> expected;
    for (Numbers& values : compute(nullptr)) expected.push_back({std::move(values), {}, {}});
    std::vector<double> change(expected.size(), 0x1p-119);
    for (int sample = 0; sample < samples; ++sample) {
        NetNoise noise(static_cast<unsigned>(sample) + 1);
        const std::vector<Numbers> moved = compute(&noise);
        for (std::size_t t = 0; t < expected.size(); ++t)
            for (std::size_t i = 0; i < moved[t].size(); ++i)
                change[t] = std::max(change[t], std::abs(moved[t][i] - expected[t].value[i]));
    }
    for (std::size_t t = 0; t < expected.size(); ++t)
        expected[t].allowed.assign(expected[t].value.size(), change[t]);
    return expected;
}

Expected joined(const std::vector<Expected>& tensors) {
    Expected all;
    for (const Expected& tensor : tensors) {
        all.value.insert(all.value.end(), tensor.value.begin(), tensor.value.end());
        all.allowed.insert(all.allowed.end(), tensor.allowed.begin(), tensor.allowed.end());
    }
    return all;
}

std::vector<float> joined(const std::vector<std::vector<float>>& tensors) {
    std::vector<float> all;
    for (const std::vector<float>& tensor : tensors)
        all.insert(all.end(), tensor.begin(), tensor.end());
    return all;
}

}  // namespace vkrun::stress

#pragma once

#include <span>

#include "vk/recorder.h"

namespace splat::ops {

struct TensorStats {
    std::uint64_t nan_count = 0;
    std::uint64_t inf_count = 0;
    double min = 0;   ///< smallest finite element; +inf without any
    double max = 0;   ///< largest finite element; -inf without any
    double mean = 0;  ///< mean of the finite elements; 0 without any
};

/// Bytes of `partial` for this many elements.
std::uint64_t tensor_stats_partial_bytes(std::uint64_t elements);

/// Measure a tensor: chunks on the device, then tensor_stats_merge on the host.
///
/// x            float32, `elements` from the start of the view
/// partial      out, tensor_stats_partial_bytes
/// Errors       kUnsupported beyond the device's binding limits
/// Precision    min, max and counts exact; mean within 2e-6 of the largest magnitude
///              (tests/ops/tensor_stats_test.cpp)
/// Determinism  bit-exact for any thread count
/// Source       the definitions
Status tensor_stats(vk::Recorder& recorder, std::uint64_t elements, const vk::BufferView& x,
                    const vk::BufferView& partial);

/// Join the partial results in the order of the chunks, in float64.
TensorStats tensor_stats_merge(std::span<const std::uint32_t> partial);

}  // namespace splat::ops

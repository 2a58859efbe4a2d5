#pragma once

#include "vk/recorder.h"

namespace splat::ops {

/// Position of the values of an element, in floats: element i starts at i * stride + offset.
struct Stride {
    std::uint32_t stride = 1;
    std::uint32_t offset = 0;
};

struct StridedCopyDesc {
    std::uint64_t count = 0;     ///< elements
    std::uint32_t channels = 1;  ///< copied floats per element
    Stride in;
    Stride out;
    bool accumulate = false;  ///< add to the existing values
};

/// Copy `channels` floats of every element from one layout to another.
///
///   y[i * out.stride + out.offset + c] = x[i * in.stride + in.offset + c]      c < channels
///
/// x, y         float32, up to the last element; y may not alias x, and is unchanged between elements. Views
///              larger than a binding of the device are copied in parts
/// Errors       kShape if an element does not fit its stride, or the views are too short;
///              kUnsupported if the floats of a part exceed 32 bits
/// Precision    exact; one addition where it accumulates
/// Determinism  bit-exact for any thread count
/// Source       shaders/ops/strided_copy.comp
Status strided_copy(vk::Recorder& recorder, const StridedCopyDesc& desc, const vk::BufferView& x,
                    const vk::BufferView& y);

}  // namespace splat::ops

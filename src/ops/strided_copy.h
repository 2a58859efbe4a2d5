#pragma once

#include "vk/recorder.h"

namespace splat::ops {

/// Where the values of an element lie, in floats: element i from i * stride + offset on.
struct Stride {
    std::uint32_t stride = 1;
    std::uint32_t offset = 0;
};

struct StridedCopyDesc {
    std::uint64_t count = 0;     ///< elements
    std::uint32_t channels = 1;  ///< floats of an element that are copied
    Stride in;
    Stride out;
    bool accumulate = false;  ///< add to what is there
};

/// Copy `channels` floats of every element from one layout to another.
///
///   y[i * out.stride + out.offset + c] = x[i * in.stride + in.offset + c]      c < channels
///
/// x, y         float32, holding the last element; y may not alias x. Between the elements y stays.
///              Larger than a binding of the device: copied in parts
/// Errors       kShape if an element does not fit its stride, or the views are too short;
///              kUnsupported for a count whose floats 32 bits do not count within a part
/// Precision    exact; one addition where it accumulates
/// Determinism  bit-exact for any thread count
/// Source       shaders/ops/strided_copy.comp
Status strided_copy(vk::Recorder& recorder, const StridedCopyDesc& desc, const vk::BufferView& x,
                    const vk::BufferView& y);

}  // namespace splat::ops

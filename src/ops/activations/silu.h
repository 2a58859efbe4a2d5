#pragma once

#include "ops/quads.h"

namespace splat::ops {

/// Sigmoid-weighted linear unit:  y = x * sigmoid(x)
///
/// x, y         [N,C,...] float32 as quads; y may be x
/// Errors       kUnsupported beyond the device's binding limits; nothing is recorded on error
/// Precision    a few roundings; exactly 0 where exp(-x) overflows (tests/ops/activations/silu_test.cpp)
/// Determinism  bit-exact for any thread count
/// Source       Elfwing et al. 2017, arXiv:1702.03118
Status silu_forward(vk::Recorder& recorder, const QuadDims& dims, const vk::BufferView& x,
                    const vk::BufferView& y);

/// Its gradient:  grad_x = grad_y * (s + x * s * (1 - s)), s = sigmoid(x). grad_x may be grad_y; the
/// rest as in the forward pass.
Status silu_backward(vk::Recorder& recorder, const QuadDims& dims, const vk::BufferView& x,
                     const vk::BufferView& grad_y, const vk::BufferView& grad_x);

}  // namespace splat::ops

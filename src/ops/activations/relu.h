#pragma once

#include "ops/quads.h"

namespace splat::ops {

/// Rectified linear unit:  y = max(x, 0)
///
/// x, y         [N,C,...] float32 as quads; y may be x
/// Errors       kUnsupported beyond the device's binding limits; nothing is recorded on error
/// Precision    exact; of NaN nothing is said
/// Determinism  bit-exact for any thread count
/// Source       Nair & Hinton 2010
Status relu_forward(vk::Recorder& recorder, const QuadDims& dims, const vk::BufferView& x,
                    const vk::BufferView& y);

/// Its gradient:  grad_x = grad_y where x > 0, else 0. `x` may be y of the forward pass; grad_x may be
/// grad_y; the rest as in the forward pass.
Status relu_backward(vk::Recorder& recorder, const QuadDims& dims, const vk::BufferView& x,
                     const vk::BufferView& grad_y, const vk::BufferView& grad_x);

}  // namespace splat::ops

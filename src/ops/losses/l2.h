#pragma once

#include "ops/losses/loss.h"

namespace splat::ops {

/// Mean squared difference of images:  loss = mean (a - b)^2
///
/// a, b         [N,C,...] float32 as quads, zero in the channels that pad a quad
/// partial      workspace of loss_partial_bytes
/// loss         [1]
/// Errors       the recorder's, beyond the device's binding limits
/// Precision    relative 1e-6 (tests/ops/losses/l2_test.cpp)
/// Determinism  bit-exact for any thread count
/// Source       the definition
Status l2_forward(vk::Recorder& recorder, const QuadDims& dims, const vk::BufferView& a,
                  const vk::BufferView& b, const vk::BufferView& partial,
                  const vk::BufferView& loss);

/// The gradient with respect to a, overwritten:  grad_a = grad_loss * 2 (a - b) / elements
Status l2_backward(vk::Recorder& recorder, const QuadDims& dims, const vk::BufferView& a,
                   const vk::BufferView& b, const vk::BufferView& grad_loss,
                   const vk::BufferView& grad_a);

extern const OpRow kL2Row;

}  // namespace splat::ops

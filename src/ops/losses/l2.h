#pragma once

#include "ops/losses/loss.h"

namespace splat::ops {

/// Mean squared difference of images:  loss = mean (a - b)^2
///
/// a, b         [N,C,...] float32 as quads, zero in the channels that pad a quad
/// loss         [1]
/// Errors       the recorder's, beyond the device's binding limits
/// Precision    relative 1e-6 (tests/ops/losses/l2_test.cpp)
/// Determinism  bit-exact for any thread count
/// Source       the definition
///
/// The gradient with respect to a, overwritten:  grad_a = grad_loss * 2 (a - b) / elements
extern const OpRow kL2Row;

}  // namespace splat::ops

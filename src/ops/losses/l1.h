#pragma once

#include "ops/losses/loss.h"

namespace splat::ops {

/// Mean absolute difference of images:  loss = mean |a - b|
///
/// a, b         [N,C,...] float32 as quads, zero in the channels that pad a quad
/// loss         [1]
/// Errors       the recorder's, beyond the device's binding limits
/// Precision    relative 1e-6 (tests/ops/losses/l1_test.cpp)
/// Determinism  bit-exact for any thread count
/// Source       the definition
///
/// The gradient with respect to a, overwritten:  grad_a = grad_loss * sign(a - b) / elements, 0 if a equals b
extern const OpRow kL1Row;

}  // namespace splat::ops

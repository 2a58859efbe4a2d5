#pragma once

#include "ops/op_table.h"

namespace splat::ops {

/// Logistic function:  y = s,  grad_x = grad_y * s * (1 - s),  s = 1 / (1 + exp(-x)). Of logits it makes the opacities
/// that the rasterizer takes.
///
/// x, y, grad_x, grad_y  [N,C,...] or [C], float32 as quads; y may be x, grad_x may be grad_y
/// Errors       kUnsupported beyond the device's binding limits; nothing is recorded on error
/// Precision    relative 4e-7 of y and of the slope, also in both tails, down to the least normal float
///              (tests/ops/activations/sigmoid_test.cpp)
/// Determinism  bit-exact for any thread count
/// Source       as exp; each tail by the exponential of a negative number
extern const OpRow kSigmoidRow;

}  // namespace splat::ops

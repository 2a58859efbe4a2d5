#pragma once

#include "ops/op_table.h"

namespace splat::ops {

/// Hyperbolic tangent:  y = tanh(x),  grad_x = grad_y * (1 - y^2)
///
/// x, y, grad_x, grad_y  [N,C,...] or [C], float32 as quads; y may be x, grad_x may be grad_y
/// Errors       kUnsupported beyond the device's binding limits; nothing is recorded on error
/// Precision    relative 5e-7 of y and 7e-7 of the slope, also where y is 1 or -1, down to the least normal float
///              (tests/ops/activations/tanh_test.cpp)
/// Determinism  bit-exact for any thread count
/// Source       the definition
extern const OpRow kTanhRow;

}  // namespace splat::ops

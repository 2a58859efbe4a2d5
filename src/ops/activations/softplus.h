#pragma once

#include "ops/op_table.h"

namespace splat::ops {

/// Softplus:  y = log(1 + exp(x)),  grad_x = grad_y / (1 + exp(-x)). It makes positive scales, as exp does, that grow
/// with x at most.
///
/// x, y, grad_x, grad_y  [N,C,...] or [C], float32 as quads; y may be x, grad_x may be grad_y
/// Errors       kUnsupported beyond the device's binding limits; nothing is recorded on error
/// Precision    relative 6e-7 of y and 4e-7 of the slope, also in the lower tail, down to the least normal float
///              (tests/ops/activations/softplus_test.cpp)
/// Determinism  bit-exact for any thread count
/// Source       Dugas et al. 2000, "Incorporating second-order functional knowledge for better option pricing", eq. 2
extern const OpRow kSoftplusRow;

}  // namespace splat::ops

#pragma once

#include "ops/op_table.h"

namespace splat::ops {

/// Sigmoid-weighted linear unit:  y = x * s,  grad_x = grad_y * (s + x * s * (1 - s)),  s = sigmoid(x)
///
/// x, y, grad_x, grad_y  [N,C,...] or [C], float32 as quads; y may be x, grad_x may be grad_y
/// Errors       kUnsupported beyond the device's binding limits; nothing is recorded on error
/// Precision    a few roundings; exactly 0 where exp(-x) overflows (tests/ops/activations/silu_test.cpp)
/// Determinism  bit-exact for any thread count
/// Source       Elfwing et al. 2017, arXiv:1702.03118
extern const OpRow kSiluRow;

}  // namespace splat::ops

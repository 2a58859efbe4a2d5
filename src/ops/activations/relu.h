#pragma once

#include "ops/op_table.h"

namespace splat::ops {

/// Rectified linear unit:  y = max(x, 0),  grad_x = grad_y where x > 0, else 0
///
/// x, y, grad_x, grad_y  [N,C,...] or [C], float32 as quads; y may be x, grad_x may be grad_y
/// Errors       kUnsupported beyond the device's binding limits; nothing is recorded on error
/// Precision    exact; undefined for NaN
/// Determinism  bit-exact for any thread count
/// Source       Nair & Hinton 2010
extern const OpRow kReluRow;

}  // namespace splat::ops

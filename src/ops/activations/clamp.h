#pragma once

#include "ops/op_table.h"

namespace splat::ops {

/// Numbers kept between two bounds:  y = min(max(x, least), most),  grad_x = grad_y where least <= x <= most, else 0,
/// as torch.clamp has it at the bounds, too.
///
/// x, y, grad_x, grad_y  [N,C,...] or [C], float32 as quads; y may be x, grad_x may be grad_y
/// least, most  least <= most; without them only infinities change
/// Errors       kInvalidArgument for bounds that are no float32 numbers or in the wrong order, kUnsupported beyond the
///              device's binding limits; nothing is recorded on error
/// Precision    exact; NaN stays NaN, and has no gradient
/// Determinism  bit-exact for any thread count
/// Source       the definition
extern const OpRow kClampRow;

}  // namespace splat::ops

#pragma once

#include "ops/op_table.h"
#include "ops/quads.h"

namespace splat::ops {

/// Separate three interleaved tensors:  part_j[n,c] = x[n, 3c + j]
///
/// x            [N,3C,...] float32 as quads; a, b, c [N,C,...] as quads; no aliasing
/// Errors       kUnsupported beyond the device's binding limits; nothing is recorded on error
/// Precision    exact
/// Determinism  bit-exact for any thread count
/// Source       the order of channels of the U-Net's qkv projection (Karras et al. 2022,
///              arXiv:2206.00364)
///
/// The gradient:  grad_x[n, 3c + j] = grad_part_j[n,c]; the rest as in the forward pass.
extern const OpRow kSplit3Row;

}  // namespace splat::ops

#pragma once

#include "ops/op_table.h"
#include "ops/quads.h"

namespace splat::ops {

/// Separate three interleaved tensors:  part_j[n,c] = x[n, 3c + j],  or with `stacked` three that follow each
/// other:  part_j[n,c] = x[n, jC + c]
///
/// x            [N,3C,...] float32 as quads; a, b, c [N,C,...] as quads; no aliasing
/// Errors       kUnsupported beyond the device's binding limits; kShape where stacked parts are not of whole quads;
///              nothing is recorded on error
/// Precision    exact
/// Determinism  bit-exact for any thread count
/// Source       the order of channels of the U-Net's qkv projection (Karras et al. 2022,
///              arXiv:2206.00364); stacked: that of most other networks with attention
///
/// The gradient:  grad_x[n, 3c + j] = grad_part_j[n,c], or grad_x[n, jC + c]; the rest as in the forward pass.
extern const OpRow kSplit3Row;

}  // namespace splat::ops

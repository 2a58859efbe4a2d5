#pragma once

#include "ops/op_table.h"
#include "ops/quads.h"

namespace splat::ops {

struct DropoutDesc {
    QuadDims x;
    double p = 0;              ///< probability of dropping an element, 0 <= p < 1
    std::uint32_t stream = 0;  ///< distinguishes the calls of one step
};

/// Errors: kInvalidArgument for p outside [0, 1).
Status dropout_check(const DropoutDesc& desc);

/// Words below this drop their element.
std::uint32_t dropout_threshold(double p);

/// Drop elements at random:  y = x / (1 - p) where kept, else 0
///
/// Element k of quad i (of the layout, see quads.h) is kept if word k of
/// philox((i, step, stream + stream offset, 0), seed) is at least p * 2^32.
///
/// x, y         [N,C,...] float32 as quads; y may be x
/// counter      4 words: seed low, seed high, step, stream offset
/// Errors       those of dropout_check; nothing is recorded on error
/// Precision    one rounding
/// Determinism  bit-exact for any thread count; the same mask on every device
/// Source       Srivastava et al. 2014 (inverted form); core/rng.h
///
/// The gradient: grad_x = grad_y / (1 - p) where kept, else 0, with the same counter. The rest as in
/// the forward pass.
extern const OpRow kDropoutRow;

}  // namespace splat::ops

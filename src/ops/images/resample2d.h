#pragma once

#include "ops/op_table.h"
#include "ops/quads.h"

namespace splat::ops {

struct Resample2dDesc {
    std::uint32_t n = 1;
    std::uint32_t c = 1;
    std::uint32_t height = 1;  ///< size of x
    std::uint32_t width = 1;
    bool up = false;         ///< to twice the size, else to half
    std::uint32_t taps = 0;  ///< length of the filter; 0 for the box [1,1]
};

/// Errors: kShape for odd sizes where they are halved; kInvalidArgument for a filter of an odd
/// length or more than 16 taps; kUnsupported for 2^31 elements.
Status resample2d_check(const Resample2dDesc& desc);

/// Separable resampling of each channel by 2, F = outer(f, f) / sum(f)^2, p = (taps - 1) / 2:
///
///   down  y[i,j] = sum_rs F[r,s] x[2i + r - p, 2j + s - p]
///   up    y[2i + r - p, 2j + s - p] += 4 F[r,s] x[i,j]
///
/// zero outside the image. With [1,1]: the mean of 2x2 pixels, and the nearest neighbour.
///
/// x, y         [N,C,H,W] and [N,C,2H,2W] or [N,C,H/2,W/2] float32 as quads; no aliasing
/// filter       [taps] row-major; absent: the box [1,1]
/// Errors       those of resample2d_check; nothing is recorded on error
/// Precision    a sum of taps^2 terms; exact for the nearest neighbour
/// Determinism  bit-exact for any thread count
/// Source       the resampling of the convolutions of Karras et al. 2022, arXiv:2206.00364
///
/// The gradient, the adjoint: resampling the other way with the same filter. The rest as in the
/// forward pass.
extern const OpRow kResample2dRow;

}  // namespace splat::ops

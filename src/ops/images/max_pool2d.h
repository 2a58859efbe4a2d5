#pragma once

#include "ops/op_table.h"
#include "ops/quads.h"

namespace splat::ops {

struct MaxPool2dDesc {
    std::uint32_t n = 1;
    std::uint32_t c = 1;
    std::uint32_t height = 2;  ///< size of x
    std::uint32_t width = 2;
};

/// Errors: kShape for fewer than 2 rows or columns.
Status max_pool2d_check(const MaxPool2dDesc& desc);

/// The maximum of each window of 2x2 pixels, windows side by side:
///
///   y[i,j] = max over r, s < 2 of x[2i + r, 2j + s]
///
/// x, y         [N,C,H,W] and [N,C,H/2,W/2] (rounded down) float32 as quads; no aliasing
/// Errors       those of max_pool2d_check, and the recorder's; nothing is recorded on error
/// Precision    exact; undefined for NaN
/// Determinism  bit-exact for any thread count
/// Source       the definition, as in torch.nn.MaxPool2d(2, 2)
///
/// The gradient: that of y goes to the first maximum of its window, row by row; pixels of a last odd row or
/// column get 0.
extern const OpRow kMaxPool2dRow;

}  // namespace splat::ops

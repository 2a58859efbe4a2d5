#pragma once

#include "ops/op_table.h"
#include "ops/quads.h"

namespace splat::ops {

struct Pad2dDesc {
    std::uint32_t n = 1;
    std::uint32_t c = 1;
    std::uint32_t height = 1;  ///< size of x
    std::uint32_t width = 1;
    std::int32_t top = 0;  ///< rows to add above, or, if negative, to cut off
    std::int32_t bottom = 0;
    std::int32_t left = 0;
    std::int32_t right = 0;
    bool replicate = false;
};

/// Errors: kShape if nothing of x is left, kUnsupported for 2^31 elements and for more than 64 rows or columns of the
/// nearest pixel.
Status pad2d_check(const Pad2dDesc& desc);

/// Rows and columns added to each side, or cut off:
///
///   y[i,j] = x[i - top, j - left], outside of x 0, or the nearest pixel of x if `replicate`
///
/// x, y         [N,C,H,W] and [N,C,H + top + bottom,W + left + right] float32 as quads; no aliasing
/// Errors       those of pad2d_check, and the recorder's; nothing is recorded on error
/// Precision    exact; gradients of replicated pixels are sums
/// Determinism  bit-exact for any thread count
/// Source       the definition, as in torch.nn.functional.pad
///
/// The gradient of a pixel: the sum of those of its copies.
Status pad2d_forward(vk::Recorder& recorder, const Pad2dDesc& desc, const vk::BufferView& x,
                     const vk::BufferView& y);
Status pad2d_backward(vk::Recorder& recorder, const Pad2dDesc& desc, const vk::BufferView& grad_y,
                      const vk::BufferView& grad_x);
extern const OpRow kPad2dRow;

}  // namespace splat::ops

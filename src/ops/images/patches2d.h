#pragma once

#include "ops/op_table.h"
#include "ops/quads.h"

namespace splat::ops {

struct Patches2dDesc {
    std::uint32_t n = 1;
    std::uint32_t c = 1;       ///< channels of the image
    std::uint32_t height = 1;  ///< size of the image
    std::uint32_t width = 1;
    std::uint32_t size = 1;
};

/// Errors: kShape for an image that patches do not fill, kUnsupported for 2^31 elements.
Status patches2d_check(const Patches2dDesc& desc);

/// The pixels of each patch of size x size pixels as channels of one:
///
///   y[(c * size + r) * size + s, i, j] = x[c, i * size + r, j * size + s]        r, s < size
///
/// and with `up` the inverse, from y to x. With a 1x1 convolution behind it, it is a convolution whose kernel and
/// stride are `size`; the inverse behind one is a transposed convolution of that kind.
///
/// x, y         [N,C,H,W] and [N,C*size*size,H/size,W/size] float32 as quads; no aliasing
/// Errors       those of patches2d_check, and the recorder's; nothing is recorded on error
/// Precision    exact
/// Determinism  bit-exact for any thread count
/// Source       the definition, as in torch.nn.PixelUnshuffle and PixelShuffle
///
/// The gradient: the other direction.
extern const OpRow kPatches2dRow;

}  // namespace splat::ops

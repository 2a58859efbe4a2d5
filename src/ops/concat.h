#pragma once

#include "ops/op_table.h"
#include "ops/quads.h"

namespace splat::ops {

struct ConcatDesc {
    std::uint32_t columns = 1;  ///< n * p
    std::uint32_t a = 1;        ///< channels of the first part
    std::uint32_t b = 1;        ///< channels of the second part
};

/// Concatenation along the channels:  y[n] = (a[n], b[n])
///
/// a, b, y      [N,A,...], [N,B,...] and [N,A+B,...] float32 as quads; no aliasing
/// Errors       kUnsupported for 2^31 elements; nothing is recorded on error
/// Precision    exact
/// Determinism  bit-exact for any thread count
/// Source       the definition; two copies where A is a multiple of 4 (src/ops/README.md, "Layout")
Status concat_forward(vk::Recorder& recorder, const ConcatDesc& desc, const vk::BufferView& a,
                      const vk::BufferView& b, const vk::BufferView& y);

/// The gradients, the parts of grad_y. Those without a buffer are not computed. The rest as in the
/// forward pass.
Status concat_backward(vk::Recorder& recorder, const ConcatDesc& desc, const vk::BufferView& grad_y,
                       const vk::BufferView& grad_a, const vk::BufferView& grad_b);

extern const OpRow kConcatRow;

}  // namespace splat::ops

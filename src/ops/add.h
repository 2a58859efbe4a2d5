#pragma once

#include "ops/op_table.h"
#include "ops/quads.h"

namespace splat::ops {

struct AddDesc {
    QuadDims x;
    float scale = 1;
};

/// Sum of two activations:  y = scale * (a + b)
///
/// a, b, y      [N,C,...] float32 as quads; y may be a or b
/// Errors       kUnsupported beyond the device's binding limits; nothing is recorded on error
/// Precision    two roundings
/// Determinism  bit-exact for any thread count
/// Source       the definition
Status add_forward(vk::Recorder& recorder, const AddDesc& desc, const vk::BufferView& a,
                   const vk::BufferView& b, const vk::BufferView& y);

/// The gradient, the same for a and b:  grad_x = scale * grad_y. grad_x may be grad_y; the rest as in the
/// forward pass.
Status add_backward(vk::Recorder& recorder, const AddDesc& desc, const vk::BufferView& grad_y,
                    const vk::BufferView& grad_x);

extern const OpRow kAddRow;

}  // namespace splat::ops

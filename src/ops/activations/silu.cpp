#include "ops/activations/silu.h"

#include "ops/activations/activation.h"
#include "ops/launch.h"

namespace splat::ops {
Status silu_forward(vk::Recorder& recorder, const QuadDims& dims, const vk::BufferView& x,
                    const vk::BufferView& y) {
    return record_activation(recorder, "silu_forward",
                             pick(recorder.kernels(), "silu_forward", "silu_forward_cpu"), dims,
                             {vk::read(x), vk::write(y)}, 8);
}

Status silu_backward(vk::Recorder& recorder, const QuadDims& dims, const vk::BufferView& x,
                     const vk::BufferView& grad_y, const vk::BufferView& grad_x) {
    return record_activation(recorder, "silu_backward",
                             pick(recorder.kernels(), "silu_backward", "silu_backward_cpu"), dims,
                             {vk::read(x), vk::read(grad_y), vk::write(grad_x)}, 8);
}

}  // namespace splat::ops

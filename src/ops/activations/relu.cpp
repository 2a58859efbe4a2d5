#include "ops/activations/relu.h"

#include "ops/activations/activation.h"
#include "ops/launch.h"

namespace splat::ops {
Status relu_forward(vk::Recorder& recorder, const QuadDims& dims, const vk::BufferView& x,
                    const vk::BufferView& y) {
    return record_activation(recorder, "relu_forward",
                             pick(recorder.kernels(), "relu_forward", "relu_forward_cpu"), dims,
                             {vk::read(x), vk::write(y)}, 1);
}

Status relu_backward(vk::Recorder& recorder, const QuadDims& dims, const vk::BufferView& x,
                     const vk::BufferView& grad_y, const vk::BufferView& grad_x) {
    return record_activation(recorder, "relu_backward",
                             pick(recorder.kernels(), "relu_backward", "relu_backward_cpu"), dims,
                             {vk::read(x), vk::read(grad_y), vk::write(grad_x)}, 1);
}

}  // namespace splat::ops

#include "ops/relu.h"

#include "ops/activation.h"

namespace splat::ops {
Status relu_forward(vk::Recorder& recorder, const QuadDims& dims, const vk::BufferView& x,
                    const vk::BufferView& y) {
    return record_activation(recorder, "relu_forward", dims, {vk::read(x), vk::write(y)}, 1);
}

Status relu_backward(vk::Recorder& recorder, const QuadDims& dims, const vk::BufferView& x,
                     const vk::BufferView& grad_y, const vk::BufferView& grad_x) {
    return record_activation(recorder, "relu_backward", dims,
                             {vk::read(x), vk::read(grad_y), vk::write(grad_x)}, 1);
}

}  // namespace splat::ops

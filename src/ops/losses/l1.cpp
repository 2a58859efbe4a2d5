#include "ops/losses/l1.h"

namespace splat::ops {

Status l1_forward(vk::Recorder& recorder, const QuadDims& dims, const vk::BufferView& a,
                  const vk::BufferView& b, const vk::BufferView& partial,
                  const vk::BufferView& loss) {
    return pixel_loss_forward(recorder, "l1_forward", dims, a, b, partial, loss);
}

Status l1_backward(vk::Recorder& recorder, const QuadDims& dims, const vk::BufferView& a,
                   const vk::BufferView& b, const vk::BufferView& grad_loss,
                   const vk::BufferView& grad_a) {
    return pixel_loss_backward(recorder, "l1_backward", dims, a, b, grad_loss, grad_a);
}

}  // namespace splat::ops

#include "ops/losses/l2.h"

namespace splat::ops {

Status l2_forward(vk::Recorder& recorder, const QuadDims& dims, const vk::BufferView& a,
                  const vk::BufferView& b, const vk::BufferView& partial,
                  const vk::BufferView& loss) {
    return pixel_loss_forward(recorder, "l2_forward", dims, a, b, partial, loss);
}

Status l2_backward(vk::Recorder& recorder, const QuadDims& dims, const vk::BufferView& a,
                   const vk::BufferView& b, const vk::BufferView& grad_loss,
                   const vk::BufferView& grad_a) {
    return pixel_loss_backward(recorder, "l2_backward", dims, a, b, grad_loss, grad_a);
}

}  // namespace splat::ops

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

namespace {

Result<OpPlan> l1_plan(const vk::Recorder&, const Attributes&, std::span<const Shape> inputs) {
    return loss_plan("l1", inputs);
}

}  // namespace

const OpRow kL1Row = {.name = "l1",
                      .equation = "loss = mean |a - b|",
                      .inputs = kLossInputs,
                      .outputs = kLossOutputs,
                      .plan = l1_plan,
                      .forward = loss_forward<l1_forward>,
                      .backward = loss_backward<l1_backward>};

}  // namespace splat::ops

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

namespace {

Result<OpPlan> l2_plan(const vk::Recorder&, const Attributes&, std::span<const Shape> inputs) {
    return loss_plan("l2", inputs);
}

}  // namespace

const OpRow kL2Row = {.name = "l2",
                      .equation = "loss = mean (a - b)^2",
                      .inputs = kLossInputs,
                      .outputs = kLossOutputs,
                      .plan = l2_plan,
                      .forward = loss_forward<l2_forward>,
                      .backward = loss_backward<l2_backward>};

}  // namespace splat::ops

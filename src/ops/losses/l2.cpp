#include "ops/losses/l2.h"

namespace splat::ops {

const OpRow kL2Row = {
    .name = "l2",
    .equation = "loss = mean (a - b)^2",
    .inputs = kLossInputs,
    .outputs = kLossOutputs,
    .plan = [](const vk::Recorder&, const Attributes&,
               std::span<const Shape> inputs) { return loss_plan("l2", inputs); },
    .forward = [](vk::Recorder& recorder, const Attributes&,
                  const OpViews& v) { return pixel_loss_forward(recorder, "l2_forward", v); },
    .backward = [](vk::Recorder& recorder, const Attributes&,
                   const OpViews& v) { return pixel_loss_backward(recorder, "l2_backward", v); }};

}  // namespace splat::ops

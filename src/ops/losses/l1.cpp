#include "ops/losses/l1.h"

namespace splat::ops {

const OpRow kL1Row = {
    .name = "l1",
    .equation = "loss = mean |a - b|",
    .inputs = kLossInputs,
    .outputs = kLossOutputs,
    .plan = [](const vk::Recorder&, const Attributes&,
               std::span<const Shape> inputs) { return loss_plan("l1", inputs); },
    .forward = [](vk::Recorder& recorder, const Attributes&,
                  const OpViews& v) { return pixel_loss_forward(recorder, "l1_forward", v); },
    .backward = [](vk::Recorder& recorder, const Attributes&,
                   const OpViews& v) { return pixel_loss_backward(recorder, "l1_backward", v); }};

}  // namespace splat::ops

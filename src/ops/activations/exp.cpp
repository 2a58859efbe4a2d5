#include "ops/activations/exp.h"

#include "ops/activations/activation.h"

namespace splat::ops {
namespace {

Status exp_row_forward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    return activation_forward(recorder, "exp_forward", v, 25);
}

Status exp_row_backward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    return activation_backward(recorder, "exp_backward", v, 26);
}

}  // namespace

const OpRow kExpRow = {.name = "exp",
                       .equation = "y = exp(x)",
                       .inputs = kInputX,
                       .outputs = kOutputY,
                       .plan = activation_plan,
                       .forward = exp_row_forward,
                       .backward = exp_row_backward};

}  // namespace splat::ops

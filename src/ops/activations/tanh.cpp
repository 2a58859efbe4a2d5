#include "ops/activations/tanh.h"

#include "ops/activations/activation.h"

namespace splat::ops {
namespace {

Status tanh_row_forward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    return activation_forward(recorder, "tanh_forward", v, 43);
}

Status tanh_row_backward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    return activation_backward(recorder, "tanh_backward", v, 33);
}

}  // namespace

const OpRow kTanhRow = {.name = "tanh",
                        .equation = "y = tanh(x)",
                        .inputs = kInputX,
                        .outputs = kOutputY,
                        .plan = activation_plan,
                        .forward = tanh_row_forward,
                        .backward = tanh_row_backward};

}  // namespace splat::ops

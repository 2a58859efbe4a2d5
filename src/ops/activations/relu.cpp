#include "ops/activations/relu.h"

#include "ops/activations/activation.h"

namespace splat::ops {
namespace {

Status relu_row_forward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    return activation_forward(recorder, "relu_forward", v, 1);
}

Status relu_row_backward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    return activation_backward(recorder, "relu_backward", v, 1);
}

}  // namespace

const OpRow kReluRow = {.name = "relu",
                        .equation = "y = max(x, 0)",
                        .inputs = kInputX,
                        .outputs = kOutputY,
                        .plan = activation_plan,
                        .forward = relu_row_forward,
                        .backward = relu_row_backward};

}  // namespace splat::ops

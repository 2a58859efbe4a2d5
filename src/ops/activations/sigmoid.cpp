#include "ops/activations/sigmoid.h"

#include "ops/activations/activation.h"

namespace splat::ops {
namespace {

Status sigmoid_row_forward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    return activation_forward(recorder, "sigmoid_forward", v, 30);
}

Status sigmoid_row_backward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    return activation_backward(recorder, "sigmoid_backward", v, 31);
}

}  // namespace

const OpRow kSigmoidRow = {.name = "sigmoid",
                           .equation = "y = 1 / (1 + exp(-x))",
                           .inputs = kInputX,
                           .outputs = kOutputY,
                           .plan = activation_plan,
                           .forward = sigmoid_row_forward,
                           .backward = sigmoid_row_backward};

}  // namespace splat::ops

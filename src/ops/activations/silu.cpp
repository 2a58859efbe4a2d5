#include "ops/activations/silu.h"

#include "ops/activations/activation.h"

namespace splat::ops {
namespace {

Status silu_row_forward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    return activation_forward(recorder, "silu_forward", v, 8);
}

Status silu_row_backward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    return activation_backward(recorder, "silu_backward", v, 8);
}

}  // namespace

const OpRow kSiluRow = {.name = "silu",
                        .equation = "y = x * sigmoid(x)",
                        .inputs = kInputX,
                        .outputs = kOutputY,
                        .plan = activation_plan,
                        .forward = silu_row_forward,
                        .backward = silu_row_backward};

}  // namespace splat::ops

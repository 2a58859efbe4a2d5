#include "ops/activations/softplus.h"

#include "ops/activations/activation.h"

namespace splat::ops {
namespace {

Status softplus_row_forward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    return activation_forward(recorder, "softplus_forward", v, 45);
}

Status softplus_row_backward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    return activation_backward(recorder, "softplus_backward", v, 31);
}

}  // namespace

const OpRow kSoftplusRow = {.name = "softplus",
                            .equation = "y = log(1 + exp(x))",
                            .inputs = kInputX,
                            .outputs = kOutputY,
                            .plan = activation_plan,
                            .forward = softplus_row_forward,
                            .backward = softplus_row_backward};

}  // namespace splat::ops

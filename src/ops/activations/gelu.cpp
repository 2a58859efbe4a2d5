#include "ops/activations/gelu.h"

#include "ops/activations/activation.h"

namespace splat::ops {
namespace {

constexpr Attribute kGeluAttributes[] = {
    {"tanh", "boolean", "false", "the approximation by tanh"},
};

/// ActivationParams::form.
std::uint32_t gelu_form(const Attributes& attributes) {
    return attributes.boolean("tanh") ? 1 : 0;
}

Status gelu_row_forward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    return activation_forward(recorder, "gelu_forward", v, 40, {gelu_form(attributes)});
}

Status gelu_row_backward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    return activation_backward(recorder, "gelu_backward", v, 45, {gelu_form(attributes)});
}

}  // namespace

const OpRow kGeluRow = {
    .name = "gelu",
    .equation = "y = x * Phi(x); tanh: y = x/2 * (1 + tanh(sqrt(2/pi) * (x + 0.044715 * x^3)))",
    .inputs = kInputX,
    .outputs = kOutputY,
    .attributes = kGeluAttributes,
    .plan = activation_plan,
    .forward = gelu_row_forward,
    .backward = gelu_row_backward};

}  // namespace splat::ops

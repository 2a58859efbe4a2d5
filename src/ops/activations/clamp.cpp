#include "ops/activations/clamp.h"

#include <cfloat>

#include "ops/activations/activation.h"

namespace splat::ops {
namespace {

constexpr Attribute kClampAttributes[] = {
    {"least", "number", "-3.4028234663852886e38", "lower bound"},
    {"most", "number", "3.4028234663852886e38", "upper bound"},
};

Result<OpPlan> clamp_plan(const vk::Recorder& recorder, const Attributes& attributes,
                          std::span<const Shape> inputs) {
    const double least = attributes.number("least");
    const double most = attributes.number("most");
    constexpr auto kLargest = static_cast<double>(FLT_MAX);
    if (!(-kLargest <= least && least <= most && most <= kLargest))
        return invalid("clamp: least is %g and most is %g, expected two float32 numbers in order",
                       least, most);
    return activation_plan(recorder, attributes, inputs);
}

ActivationNumbers bounds_of(const Attributes& attributes) {
    return {.least = static_cast<float>(attributes.number("least")),
            .most = static_cast<float>(attributes.number("most"))};
}

Status clamp_row_forward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    return activation_forward(recorder, "clamp_forward", v, 2, bounds_of(attributes));
}

Status clamp_row_backward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    return activation_backward(recorder, "clamp_backward", v, 2, bounds_of(attributes));
}

}  // namespace

const OpRow kClampRow = {.name = "clamp",
                         .equation = "y = min(max(x, least), most)",
                         .inputs = kInputX,
                         .outputs = kOutputY,
                         .attributes = kClampAttributes,
                         .plan = clamp_plan,
                         .forward = clamp_row_forward,
                         .backward = clamp_row_backward};

}  // namespace splat::ops

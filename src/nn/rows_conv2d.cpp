#include <algorithm>

#include "nn/op_rows.h"
#include "ops/conv2d.h"
#include "ops/conv2d_algorithm.h"

namespace splat::nn {
namespace {

using vk::BufferView;

constexpr Port kConv2dInputs[] = {{"x"},
                                  {"weight", Layout::kRowMajor},
                                  {"bias", Layout::kRowMajor, true},
                                  {"residual", Layout::kQuads, true}};
constexpr Attribute kConv2dAttributes[] = {
    {"scale", "number", "1", "factor of the output"},
    {"winograd", "integer", "0", "2 or 4: by F(2x2) or F(4x4), for kernels of 3x3; 0: directly"},
    {"precision", "integer", "0",
     "1 strict, 2 balanced, 3 fast: winograd by the table for the shape; 0: as winograd says"},
};

Status check_attributes(const Attributes& attributes) {
    const std::int64_t precision = attributes.integer("precision");
    const std::int64_t winograd = attributes.integer("winograd");
    if (precision < 0 || precision > 3)
        return error(Code::kInvalidArgument, "conv2d: precision = %lld, expected 0 to 3",
                     static_cast<long long>(precision));
    if (precision > 0 && winograd != 0)
        return error(Code::kInvalidArgument,
                     "conv2d: winograd = %lld with precision = %lld, which chooses it; expected "
                     "one of them",
                     static_cast<long long>(winograd), static_cast<long long>(precision));
    return {};
}

ops::Conv2dDesc conv2d_desc(const Attributes& attributes, const Shape& x, const Shape& weight,
                            bool bias) {
    ops::Conv2dDesc desc{.n = x[0],
                         .in_channels = x[1],
                         .height = x[2],
                         .width = x[3],
                         .out_channels = weight[0],
                         .kernel = weight[2],
                         .bias = bias,
                         .scale = static_cast<float>(attributes.number("scale")),
                         .winograd = static_cast<std::int32_t>(
                             std::clamp<std::int64_t>(attributes.integer("winograd"), -1, 99))};
    const std::int64_t precision = attributes.integer("precision");
    if (precision > 0 && desc.kernel == 3)
        desc.winograd =
            ops::conv2d_algorithm(desc, static_cast<ops::Conv2dPrecision>(precision - 1));
    return desc;
}

Result<OpPlan> conv2d_plan(const vk::Recorder& recorder, const Attributes& attributes,
                           std::span<const Shape> inputs) {
    const Shape& x = inputs[0];
    const Shape& weight = inputs[1];
    SPLAT_TRY(check_attributes(attributes));
    if (x.rank() != 4)
        return error(Code::kShape, "conv2d: tensor 'x' has shape %s, expected [N, C, H, W]",
                     x.text().c_str());
    if (weight.rank() != 4)
        return error(Code::kShape, "conv2d: tensor 'weight' has shape %s, expected [K, C, R, R]",
                     weight.text().c_str());
    SPLAT_TRY(expect_shape("conv2d", "weight", weight, {weight[0], x[1], weight[2], weight[2]}));
    const bool bias = inputs[2].rank() > 0;
    if (bias) SPLAT_TRY(expect_shape("conv2d", "bias", inputs[2], {weight[0]}));
    OpPlan plan;
    plan.outputs = {{x[0], weight[0], x[2], x[3]}};
    if (inputs[3].rank() > 0)
        SPLAT_TRY(expect_shape("conv2d", "residual", inputs[3], plan.outputs[0]));
    const ops::Conv2dDesc desc = conv2d_desc(attributes, x, weight, bias);
    SPLAT_TRY(ops::conv2d_check(desc));
    plan.forward_prepared = ops::conv2d_prepared_bytes(recorder, desc, false);
    plan.backward_prepared = ops::conv2d_prepared_bytes(recorder, desc, true);
    plan.forward_workspace = ops::conv2d_forward_bytes(recorder, desc);
    plan.backward_workspace = std::max(ops::conv2d_backward_input_bytes(recorder, desc),
                                       ops::conv2d_backward_weight_bytes(recorder, desc));
    plan.adds = ops::conv2d_adds(recorder, desc);
    plan.passes = desc.scale == 1 ? 1U << 3 : 0;
    return plan;
}

ops::Conv2dDesc conv2d_desc(const Attributes& attributes, const OpViews& v) {
    return conv2d_desc(attributes, v.inputs[0].shape, v.inputs[1].shape, present(v.inputs[2]));
}

Status conv2d_prepare(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v,
                      Pass pass) {
    const bool transposed = pass == Pass::kBackward;
    return ops::conv2d_prepare_weight(recorder, conv2d_desc(attributes, v), v.inputs[1],
                                      transposed ? v.backward_prepared : v.forward_prepared,
                                      transposed);
}

Status conv2d_forward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    const ops::Conv2dDesc desc = conv2d_desc(attributes, v);
    const BufferView& weight = present(v.forward_prepared) ? v.forward_prepared : v.inputs[1];
    return ops::conv2d_forward(recorder, desc, v.inputs[0], weight,
                               desc.bias ? v.inputs[2] : v.inputs[1], v.inputs[3], v.outputs[0],
                               v.workspace);
}

Status conv2d_backward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    const ops::Conv2dDesc desc = conv2d_desc(attributes, v);
    const BufferView& weight = present(v.backward_prepared) ? v.backward_prepared : v.inputs[1];
    const BufferView& grad_y = v.grad_outputs[0];
    if (present(v.grad_inputs[0]) || present(v.grad_inputs[1]))
        SPLAT_TRY(ops::conv2d_backward_begin(recorder, desc, grad_y, v.workspace));
    if (present(v.grad_inputs[0]))
        SPLAT_TRY(ops::conv2d_backward_input(recorder, desc, weight, grad_y, v.grad_inputs[0],
                                             v.workspace, v.addend));
    if (present(v.grad_inputs[1])) {
        const BufferView workspace =
            v.workspace.part(0, ops::conv2d_backward_weight_bytes(recorder, desc));
        SPLAT_TRY(ops::conv2d_backward_weight(recorder, desc, v.inputs[0], grad_y, v.grad_inputs[1],
                                              workspace, v.accumulate));
    }
    if (present(v.grad_inputs[2]))
        SPLAT_TRY(
            ops::conv2d_backward_bias(recorder, desc, grad_y, v.grad_inputs[2], v.accumulate));
    if (!present(v.grad_inputs[3])) return {};
    return ops::conv2d_backward_residual(recorder, desc, grad_y, v.grad_inputs[3]);
}

}  // namespace

const OpRow kConv2dRow = {
    .name = "conv2d",
    .equation = "y = (conv(x, weight) + bias + residual) * scale, stride 1, zero padding",
    .inputs = kConv2dInputs,
    .outputs = kOutputY,
    .saved = {},
    .attributes = kConv2dAttributes,
    .plan = conv2d_plan,
    .prepare = conv2d_prepare,
    .forward = conv2d_forward,
    .backward = conv2d_backward,
    .backward_reads = product_backward_reads};

}  // namespace splat::nn

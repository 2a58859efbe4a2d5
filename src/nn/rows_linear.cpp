#include "nn/op_rows.h"
#include "ops/linear.h"

namespace splat::nn {
namespace {

using vk::BufferView;

constexpr Port kLinearInputs[] = {
    {"x"}, {"weight", Layout::kRowMajor}, {"bias", Layout::kRowMajor, true}};

ops::LinearDesc linear_desc(const Shape& x, const Shape& weight, bool bias) {
    return {x[0], x[1], weight[0], bias};
}

Result<OpPlan> linear_plan(const vk::Recorder& recorder, const Attributes&,
                           std::span<const Shape> inputs) {
    const Shape& x = inputs[0];
    const Shape& weight = inputs[1];
    if (x.rank() != 2)
        return error(Code::kShape, "linear: tensor 'x' has shape %s, expected [rows, in]",
                     x.text().c_str());
    if (weight.rank() != 2)
        return error(Code::kShape, "linear: tensor 'weight' has shape %s, expected [out, in]",
                     weight.text().c_str());
    SPLAT_TRY(expect_shape("linear", "weight", weight, {weight[0], x[1]}));
    const bool bias = inputs[2].rank() > 0;
    if (bias) SPLAT_TRY(expect_shape("linear", "bias", inputs[2], {weight[0]}));
    const ops::LinearDesc desc = linear_desc(x, weight, bias);
    SPLAT_TRY(ops::linear_check(desc));
    OpPlan plan;
    plan.outputs = {{x[0], weight[0]}};
    plan.forward_prepared = ops::linear_packed_bytes(recorder, desc, false);
    plan.backward_prepared = ops::linear_packed_bytes(recorder, desc, true);
    plan.backward_workspace = ops::linear_backward_weight_bytes(recorder, desc);
    return plan;
}

ops::LinearDesc linear_desc(const OpViews& v) {
    return linear_desc(v.inputs[0].shape, v.inputs[1].shape, present(v.inputs[2]));
}

Status linear_prepare(vk::Recorder& recorder, const Attributes&, const OpViews& v, Pass pass) {
    const bool transposed = pass == Pass::kBackward;
    return ops::linear_pack_weight(recorder, linear_desc(v), v.inputs[1],
                                   transposed ? v.backward_prepared : v.forward_prepared,
                                   transposed);
}

Status linear_forward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    const ops::LinearDesc desc = linear_desc(v);
    const BufferView& weight = present(v.forward_prepared) ? v.forward_prepared : v.inputs[1];
    return ops::linear_forward(recorder, desc, v.inputs[0], weight,
                               desc.bias ? v.inputs[2] : v.inputs[1], v.outputs[0]);
}

Status linear_backward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    const ops::LinearDesc desc = linear_desc(v);
    const BufferView& weight = present(v.backward_prepared) ? v.backward_prepared : v.inputs[1];
    if (present(v.grad_inputs[0]))
        SPLAT_TRY(ops::linear_backward_input(recorder, desc, weight, v.grad_outputs[0],
                                             v.grad_inputs[0]));
    if (present(v.grad_inputs[1])) {
        const BufferView partial =
            v.workspace.part(0, ops::linear_backward_weight_bytes(recorder, desc));
        SPLAT_TRY(ops::linear_backward_weight(recorder, desc, v.inputs[0], v.grad_outputs[0],
                                              v.grad_inputs[1], partial, v.accumulate));
    }
    if (!present(v.grad_inputs[2])) return {};
    return ops::linear_backward_bias(recorder, desc, v.grad_outputs[0], v.grad_inputs[2],
                                     v.accumulate);
}

}  // namespace

const OpRow kLinearRow = {.name = "linear",
                          .equation = "y = x weight^T + bias",
                          .inputs = kLinearInputs,
                          .outputs = kOutputY,
                          .saved = {},
                          .attributes = {},
                          .plan = linear_plan,
                          .prepare = linear_prepare,
                          .forward = linear_forward,
                          .backward = linear_backward,
                          .backward_reads = product_backward_reads};

}  // namespace splat::nn

#include "nn/op_rows.h"
#include "ops/attention.h"
#include "ops/concat.h"
#include "ops/split3.h"

namespace splat::nn {
namespace {

constexpr Port kAttentionInputs[] = {{"q"}, {"k"}, {"v"}};
constexpr const char* kAttentionSaved[] = {"weights"};
constexpr Attribute kAttentionAttributes[] = {
    {"heads", "integer", "1", "heads of neighbouring channels; divides the channels"},
};

Result<ops::AttentionDesc> attention_desc(const Attributes& attributes, const Shape& q,
                                          const Shape& k) {
    if (q.rank() < 3)
        return error(Code::kShape, "attention: tensor 'q' has shape %s, expected [N, C, ...]",
                     q.text().c_str());
    SPLAT_ASSIGN(const ops::QuadDims of_q, ops::quad_dims(q));
    if (k.rank() < 3 || k[0] != q[0] || k[1] != q[1])
        return error(Code::kShape, "attention: tensor 'k' has shape %s, expected [%u, %u, ...]",
                     k.text().c_str(), q[0], q[1]);
    SPLAT_ASSIGN(const ops::QuadDims of_k, ops::quad_dims(k));
    const auto heads = attributes.integer("heads");
    if (heads < 1 || heads > of_q.c)
        return error(Code::kInvalidArgument, "attention: heads is %lld, expected 1 to %u",
                     static_cast<long long>(heads), of_q.c);
    return ops::AttentionDesc{of_q.n, of_q.c, static_cast<std::uint32_t>(heads), of_q.p, of_k.p};
}

Result<OpPlan> attention_plan(const vk::Recorder& recorder, const Attributes& attributes,
                              std::span<const Shape> inputs) {
    SPLAT_ASSIGN(const ops::AttentionDesc desc, attention_desc(attributes, inputs[0], inputs[1]));
    SPLAT_TRY(expect_shape("attention", "v", inputs[2], inputs[1]));
    SPLAT_TRY(ops::attention_check(recorder.device(), desc));
    OpPlan plan;
    plan.outputs = {inputs[0]};
    plan.saved = {ops::attention_weights_shape(desc)};
    plan.forward_workspace = ops::attention_forward_bytes(desc);
    plan.backward_workspace = ops::attention_backward_bytes(recorder, desc);
    return plan;
}

Status attention_forward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    SPLAT_ASSIGN(const ops::AttentionDesc desc,
                 attention_desc(attributes, v.inputs[0].shape, v.inputs[1].shape));
    return ops::attention_forward(recorder, desc, v.inputs[0], v.inputs[1], v.inputs[2],
                                  v.outputs[0], v.saved[0], v.workspace);
}

Status attention_backward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    SPLAT_ASSIGN(const ops::AttentionDesc desc,
                 attention_desc(attributes, v.inputs[0].shape, v.inputs[1].shape));
    return ops::attention_backward(
        recorder, desc, v.inputs[0], v.inputs[1], v.inputs[2], v.saved[0], v.grad_outputs[0],
        {v.grad_inputs[0], v.grad_inputs[1], v.grad_inputs[2]}, v.workspace);
}

constexpr Port kSplit3Inputs[] = {{"x"}};
constexpr Port kSplit3Outputs[] = {{"a"}, {"b"}, {"c"}};

/// The dimensions of each part.
Result<ops::QuadDims> split3_dims(const Shape& x) {
    SPLAT_ASSIGN(ops::QuadDims dims, ops::quad_dims(x));
    if (dims.c % 3 != 0)
        return error(Code::kShape,
                     "split3: tensor 'x' has shape %s, expected a multiple of 3 channels",
                     x.text().c_str());
    dims.c /= 3;
    return dims;
}

Result<OpPlan> split3_plan(const vk::Recorder&, const Attributes&, std::span<const Shape> inputs) {
    SPLAT_ASSIGN(const ops::QuadDims part, split3_dims(inputs[0]));
    std::vector<std::int64_t> dims;
    for (std::uint32_t axis = 0; axis < inputs[0].rank(); ++axis)
        dims.push_back(axis == 1 ? part.c : inputs[0][axis]);
    SPLAT_ASSIGN(const Shape shape, Shape::create(dims, "split3"));
    OpPlan plan;
    plan.outputs = {shape, shape, shape};
    return plan;
}

Status split3_forward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    SPLAT_ASSIGN(const ops::QuadDims dims, split3_dims(v.inputs[0].shape));
    return ops::split3_forward(recorder, dims, v.inputs[0], v.outputs[0], v.outputs[1],
                               v.outputs[2]);
}

Status split3_backward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    SPLAT_ASSIGN(const ops::QuadDims dims, split3_dims(v.inputs[0].shape));
    return ops::split3_backward(recorder, dims, v.grad_outputs[0], v.grad_outputs[1],
                                v.grad_outputs[2], v.grad_inputs[0]);
}

constexpr Port kConcatInputs[] = {{"a"}, {"b"}};

Result<ops::ConcatDesc> concat_desc(const Shape& a, const Shape& b) {
    SPLAT_ASSIGN(const ops::QuadDims of_a, ops::quad_dims(a));
    bool alike = a.rank() == b.rank();
    for (std::uint32_t axis = 0; alike && axis < a.rank(); ++axis)
        alike = axis == 1 || a[axis] == b[axis];
    if (!alike)
        return error(Code::kShape,
                     "concat: tensor 'b' has shape %s, expected that of 'a', %s, but for the "
                     "channels",
                     b.text().c_str(), a.text().c_str());
    return ops::ConcatDesc{of_a.n * of_a.p, a[1], b[1]};
}

Result<OpPlan> concat_plan(const vk::Recorder&, const Attributes&, std::span<const Shape> inputs) {
    SPLAT_TRY(concat_desc(inputs[0], inputs[1]).status());
    std::vector<std::int64_t> dims;
    for (std::uint32_t axis = 0; axis < inputs[0].rank(); ++axis)
        dims.push_back(std::int64_t{inputs[0][axis]} + (axis == 1 ? inputs[1][1] : 0));
    SPLAT_ASSIGN(const Shape shape, Shape::create(dims, "concat"));
    OpPlan plan;
    plan.outputs = {shape};
    return plan;
}

Status concat_forward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    SPLAT_ASSIGN(const ops::ConcatDesc desc, concat_desc(v.inputs[0].shape, v.inputs[1].shape));
    return ops::concat_forward(recorder, desc, v.inputs[0], v.inputs[1], v.outputs[0]);
}

Status concat_backward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    SPLAT_ASSIGN(const ops::ConcatDesc desc, concat_desc(v.inputs[0].shape, v.inputs[1].shape));
    return ops::concat_backward(recorder, desc, v.grad_outputs[0], v.grad_inputs[0],
                                v.grad_inputs[1]);
}

}  // namespace

const OpRow kAttentionRow = {
    .name = "attention",
    .equation = "y[c,l] = sum_j w[l,j] v[c,j], w[l,j] = softmax_j(q[c,l] k[c,j] / sqrt(C/heads))",
    .inputs = kAttentionInputs,
    .outputs = kOutputY,
    .saved = kAttentionSaved,
    .attributes = kAttentionAttributes,
    .plan = attention_plan,
    .prepare = nullptr,
    .forward = attention_forward,
    .backward = attention_backward};

const OpRow kSplit3Row = {.name = "split3",
                          .equation = "a[n,c] = x[n,3c], b[n,c] = x[n,3c+1], c[n,c] = x[n,3c+2]",
                          .inputs = kSplit3Inputs,
                          .outputs = kSplit3Outputs,
                          .saved = {},
                          .attributes = {},
                          .plan = split3_plan,
                          .prepare = nullptr,
                          .forward = split3_forward,
                          .backward = split3_backward,
                          .backward_reads = no_backward_reads};

const OpRow kConcatRow = {.name = "concat",
                          .equation = "y = (a, b) along the channels",
                          .inputs = kConcatInputs,
                          .outputs = kOutputY,
                          .saved = {},
                          .attributes = {},
                          .plan = concat_plan,
                          .prepare = nullptr,
                          .forward = concat_forward,
                          .backward = concat_backward,
                          .backward_reads = no_backward_reads};

}  // namespace splat::nn

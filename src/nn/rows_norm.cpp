#include "core/checked_math.h"
#include "nn/op_rows.h"
#include "ops/group_norm.h"

namespace splat::nn {
namespace {

using vk::BufferView;

constexpr Port kGroupNormInputs[] = {
    {"x"}, {"gamma", Layout::kRowMajor}, {"beta", Layout::kRowMajor}};
constexpr const char* kGroupNormSaved[] = {"mean", "rstd"};
constexpr Attribute kGroupNormAttributes[] = {
    {"groups", "integer", "1", "number of groups; divides the channels"},
    {"eps", "number", "1e-6", "added to the variance; > 0"},
    {"silu", "boolean", "false", "apply SiLU in the same pass"},
};

Result<ops::GroupNormDesc> group_norm_desc(const Attributes& attributes, const Shape& x) {
    if (x.rank() < 2)
        return error(Code::kShape, "group_norm: tensor 'x' has shape %s, expected [N, C, ...]",
                     x.text().c_str());
    ops::GroupNormDesc desc;
    SPLAT_ASSIGN(desc.x, ops::quad_dims(x));
    const auto groups = attributes.integer("groups");
    if (groups < 1 || groups > desc.x.c)
        return error(Code::kInvalidArgument, "group_norm: groups is %lld, expected 1 to %u",
                     static_cast<long long>(groups), desc.x.c);
    desc.groups = static_cast<std::uint32_t>(groups);
    desc.eps = static_cast<float>(attributes.number("eps"));
    desc.silu = attributes.boolean("silu");
    return desc;
}

/// Where the workspace goes on behind the sums.
std::uint64_t sums_end(const vk::Recorder& recorder, const ops::GroupNormDesc& desc) {
    return round_up(ops::group_norm_sums_bytes(desc), recorder.device().limits.offset_alignment);
}

Result<OpPlan> group_norm_plan(const vk::Recorder& recorder, const Attributes& attributes,
                               std::span<const Shape> inputs) {
    SPLAT_ASSIGN(const ops::GroupNormDesc desc, group_norm_desc(attributes, inputs[0]));
    SPLAT_TRY(ops::group_norm_check(recorder.device(), desc));
    SPLAT_TRY(expect_shape("group_norm", "gamma", inputs[1], {desc.x.c}));
    SPLAT_TRY(expect_shape("group_norm", "beta", inputs[2], {desc.x.c}));
    OpPlan plan;
    plan.outputs = {inputs[0]};
    plan.saved = {{desc.x.n, desc.groups}, {desc.x.n, desc.groups}};
    plan.backward_workspace = sums_end(recorder, desc) + desc.x.bytes();
    return plan;
}

Status group_norm_forward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    SPLAT_ASSIGN(const ops::GroupNormDesc desc, group_norm_desc(attributes, v.inputs[0].shape));
    return ops::group_norm_forward(recorder, desc, v.inputs[0], v.inputs[1], v.inputs[2],
                                   v.outputs[0], v.saved[0], v.saved[1]);
}

Status group_norm_backward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    SPLAT_ASSIGN(const ops::GroupNormDesc desc, group_norm_desc(attributes, v.inputs[0].shape));
    // A gradient that nobody wants is written behind the sums where the other of its pair is wanted.
    const std::uint64_t end = sums_end(recorder, desc);
    const BufferView sums = v.workspace.part(0, ops::group_norm_sums_bytes(desc));
    const BufferView& grad_gamma = v.grad_inputs[1];
    const BufferView& grad_beta = v.grad_inputs[2];
    const BufferView unwanted = v.workspace.part(end, vk::quad_bytes(desc.x.c));
    const bool parameters = present(grad_gamma) || present(grad_beta);
    return ops::group_norm_backward(
        recorder, desc, v.inputs[0], v.inputs[1], v.inputs[2], v.saved[0], v.saved[1],
        v.grad_outputs[0],
        present(v.grad_inputs[0]) ? v.grad_inputs[0] : v.workspace.part(end, desc.x.bytes()),
        parameters && !present(grad_gamma) ? unwanted : grad_gamma,
        parameters && !present(grad_beta) ? unwanted : grad_beta, sums, v.accumulate);
}

}  // namespace

const OpRow kGroupNormRow = {
    .name = "group_norm",
    .equation =
        "y = gamma * (x - mean) / sqrt(var + eps) + beta over C/groups channels and all "
        "pixels; then silu(y) if silu",
    .inputs = kGroupNormInputs,
    .outputs = kOutputY,
    .saved = kGroupNormSaved,
    .attributes = kGroupNormAttributes,
    .plan = group_norm_plan,
    .forward = group_norm_forward,
    .backward = group_norm_backward};

}  // namespace splat::nn

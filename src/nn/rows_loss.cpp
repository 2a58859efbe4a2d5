#include "core/checked_math.h"
#include "nn/op_rows.h"
#include "ops/losses/feature_distance.h"
#include "ops/losses/l1.h"
#include "ops/losses/l2.h"
#include "ops/losses/ssim.h"

namespace splat::nn {
namespace {

using vk::BufferView;

constexpr Port kLossInputs[] = {{"a"}, {"b", Layout::kQuads, false, true}};
constexpr Port kLossOutputs[] = {{"loss", Layout::kRowMajor}};
constexpr const char* kSsimSaved[] = {"slopes"};

Result<OpPlan> loss_plan(const char* op, std::span<const Shape> inputs) {
    SPLAT_ASSIGN(const ops::QuadDims dims, ops::quad_dims(inputs[0]));
    SPLAT_TRY(expect_shape(op, "b", inputs[1], inputs[0]));
    OpPlan plan;
    plan.outputs = {{1}};
    plan.forward_workspace = ops::loss_partial_bytes(dims);
    return plan;
}

using LossPass = Status (*)(vk::Recorder&, const ops::QuadDims&, const BufferView&,
                            const BufferView&, const BufferView&, const BufferView&);

template <LossPass pass>
Status loss_forward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    SPLAT_ASSIGN(const ops::QuadDims dims, ops::quad_dims(v.inputs[0].shape));
    return pass(recorder, dims, v.inputs[0], v.inputs[1],
                v.workspace.part(0, ops::loss_partial_bytes(dims)), v.outputs[0]);
}

template <LossPass pass>
Status loss_backward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    SPLAT_ASSIGN(const ops::QuadDims dims, ops::quad_dims(v.inputs[0].shape));
    return pass(recorder, dims, v.inputs[0], v.inputs[1], v.grad_outputs[0], v.grad_inputs[0]);
}

Result<OpPlan> l1_plan(const vk::Recorder&, const Attributes&, std::span<const Shape> inputs) {
    return loss_plan("l1", inputs);
}

Result<OpPlan> l2_plan(const vk::Recorder&, const Attributes&, std::span<const Shape> inputs) {
    return loss_plan("l2", inputs);
}

ops::SsimDesc ssim_desc(const Shape& a) {
    return {a[0], a[1], a[2], a[3]};
}

/// Where the workspace goes on behind the rows.
std::uint64_t rows_end(const vk::Recorder& recorder, const ops::SsimDesc& desc) {
    return round_up(ops::ssim_forward_rows_bytes(desc), recorder.device().limits.offset_alignment);
}

Result<OpPlan> ssim_plan(const vk::Recorder& recorder, const Attributes&,
                         std::span<const Shape> inputs) {
    if (inputs[0].rank() != 4)
        return error(Code::kShape, "ssim: tensor 'a' has shape %s, expected [N, C, H, W]",
                     inputs[0].text().c_str());
    SPLAT_ASSIGN(OpPlan plan, loss_plan("ssim", inputs));
    const ops::SsimDesc desc = ssim_desc(inputs[0]);
    const std::uint64_t slopes = ops::ssim_slopes_bytes(desc) / 4;
    if (slopes > kMaxElements)
        return error(Code::kUnsupported, "ssim: images %s are too large: %llu slopes",
                     inputs[0].text().c_str(), static_cast<unsigned long long>(slopes));
    plan.saved = {{static_cast<std::uint32_t>(slopes)}};
    plan.forward_workspace += rows_end(recorder, desc);
    plan.backward_workspace = ops::ssim_backward_rows_bytes(desc);
    return plan;
}

Status ssim_forward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    const ops::SsimDesc desc = ssim_desc(v.inputs[0].shape);
    return ops::ssim_forward(
        recorder, desc, v.inputs[0], v.inputs[1],
        v.workspace.part(0, ops::ssim_forward_rows_bytes(desc)), v.saved[0],
        v.workspace.part(rows_end(recorder, desc), ops::loss_partial_bytes(desc.quads())),
        v.outputs[0]);
}

Status ssim_backward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    const ops::SsimDesc desc = ssim_desc(v.inputs[0].shape);
    return ops::ssim_backward(recorder, desc, v.inputs[0], v.inputs[1], v.saved[0],
                              v.workspace.part(0, ops::ssim_backward_rows_bytes(desc)),
                              v.grad_outputs[0], v.grad_inputs[0]);
}

constexpr Port kDistanceInputs[] = {
    {"a"}, {"b", Layout::kQuads, false, true}, {"weight", Layout::kRowMajor, false, true}};

Result<OpPlan> distance_plan(const vk::Recorder&, const Attributes&,
                             std::span<const Shape> inputs) {
    SPLAT_ASSIGN(const ops::QuadDims dims, ops::quad_dims(inputs[0]));
    SPLAT_TRY(expect_shape("feature_distance", "b", inputs[1], inputs[0]));
    SPLAT_TRY(expect_shape("feature_distance", "weight", inputs[2], {dims.c}));
    SPLAT_TRY(ops::feature_distance_check(dims));
    OpPlan plan;
    plan.outputs = {{dims.n, 1}};
    plan.forward_workspace = ops::feature_distance_partial_bytes(dims);
    return plan;
}

Status distance_forward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    SPLAT_ASSIGN(const ops::QuadDims dims, ops::quad_dims(v.inputs[0].shape));
    return ops::feature_distance_forward(
        recorder, dims, v.inputs[0], v.inputs[1], v.inputs[2],
        v.workspace.part(0, ops::feature_distance_partial_bytes(dims)), v.outputs[0]);
}

Status distance_backward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    SPLAT_ASSIGN(const ops::QuadDims dims, ops::quad_dims(v.inputs[0].shape));
    return ops::feature_distance_backward(recorder, dims, v.inputs[0], v.inputs[1], v.inputs[2],
                                          v.grad_outputs[0], v.grad_inputs[0]);
}

}  // namespace

const OpRow kFeatureDistanceRow = {
    .name = "feature_distance",
    .equation =
        "y[n] = mean over pixels of sum_c weight[c] (a / (|a| + eps) - b / (|b| + eps))^2, "
        "|.| over the channels, eps = 1e-10",
    .inputs = kDistanceInputs,
    .outputs = kOutputY,
    .saved = {},
    .attributes = {},
    .plan = distance_plan,
    .prepare = nullptr,
    .forward = distance_forward,
    .backward = distance_backward};

const OpRow kL1Row = {.name = "l1",
                      .equation = "loss = mean |a - b|",
                      .inputs = kLossInputs,
                      .outputs = kLossOutputs,
                      .saved = {},
                      .attributes = {},
                      .plan = l1_plan,
                      .prepare = nullptr,
                      .forward = loss_forward<ops::l1_forward>,
                      .backward = loss_backward<ops::l1_backward>};

const OpRow kL2Row = {.name = "l2",
                      .equation = "loss = mean (a - b)^2",
                      .inputs = kLossInputs,
                      .outputs = kLossOutputs,
                      .saved = {},
                      .attributes = {},
                      .plan = l2_plan,
                      .prepare = nullptr,
                      .forward = loss_forward<ops::l2_forward>,
                      .backward = loss_backward<ops::l2_backward>};

const OpRow kSsimRow = {
    .name = "ssim",
    .equation =
        "loss = mean (2 ma mb + C1) (2 cov + C2) / ((ma^2 + mb^2 + C1) (var_a + var_b + C2)), "
        "Gaussian window 11x11 of 1.5 pixels, zero padding, C1 = 1e-4, C2 = 9e-4",
    .inputs = kLossInputs,
    .outputs = kLossOutputs,
    .saved = kSsimSaved,
    .attributes = {},
    .plan = ssim_plan,
    .prepare = nullptr,
    .forward = ssim_forward,
    .backward = ssim_backward};

}  // namespace splat::nn

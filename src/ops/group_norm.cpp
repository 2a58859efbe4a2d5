#include "ops/group_norm.h"

#include <cmath>

#include "core/checked_math.h"
#include "params/group_norm_params.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

/// Up to 1024 lanes loop over a group three times, or five times where squares overflow. lavapipe then ends loops
/// unless each takes 3/5 of kMaxTurns.
std::uint64_t max_group_elements(const vk::DeviceInfo& device) {
    const std::uint64_t most = 1024 * vk::kMaxTurns;
    return device.kind == vk::DeviceKind::kCpu ? most * 3 / 5 : most;
}

/// Loops over the quads of channels of a group have up to 20 turns for each, see kMaxTurns; only lavapipe counts.
constexpr std::uint32_t kMaxGroupChannels = 4096;

params::GroupNormParams params_of(const GroupNormDesc& desc, bool accumulate) {
    return {desc.x.n,
            desc.x.c,
            desc.x.p,
            desc.groups,
            desc.eps,
            desc.silu ? 1U : 0U,
            accumulate ? 1U : 0U};
}

std::uint64_t group_elements(const GroupNormDesc& desc) {
    return std::uint64_t{desc.x.c / desc.groups} * desc.x.p;
}

/// The fast kernels take whole quads of channels.
vk::Kernels kernels_for(const vk::Recorder& recorder, const GroupNormDesc& desc) {
    return desc.x.c / desc.groups % 4 == 0 ? recorder.kernels() : vk::Kernels::kPlain;
}

/// Lanes per group. On CPU devices one subgroup, which does not wait at barriers (1.5 to 2 times as fast as
/// 64); on GPUs enough to keep a multiprocessor busy; more for very large groups.
std::uint32_t lanes_for(const vk::Recorder& recorder, const GroupNormDesc& desc,
                        vk::Kernels kernels) {
    const std::uint64_t elements = group_elements(desc);
    switch (kernels) {
        case vk::Kernels::kCpu:
            return vk::workgroup_size(recorder.device(), 8, elements / 8);
        case vk::Kernels::kGpu:
            return vk::workgroup_size(recorder.device(), 256, elements / 8);
        default:
            return vk::workgroup_size(recorder.device(), 64, ceil_div(5 * elements, 3));
    }
}

}  // namespace

Status group_norm_check(const vk::DeviceInfo& device, const GroupNormDesc& desc) {
    if (desc.groups < 1 || desc.x.c % desc.groups != 0)
        return error(Code::kShape, "group_norm: %u channels do not divide into %u groups", desc.x.c,
                     desc.groups);
    if (!std::isfinite(desc.eps) || desc.eps <= 0)
        return invalid("group_norm: eps is %g, expected a finite number > 0",
                       static_cast<double>(desc.eps));
    if (group_elements(desc) > max_group_elements(device))
        return unsupported(
            "group_norm: a group of %llu elements, expected at most %llu: use more groups",
            llu(group_elements(desc)), llu(max_group_elements(device)));
    if (device.kind == vk::DeviceKind::kCpu && desc.x.c / desc.groups > kMaxGroupChannels)
        return unsupported(
            "group_norm: a group of %u channels, expected at most %u on this device: use "
            "more groups",
            desc.x.c / desc.groups, kMaxGroupChannels);
    if (desc.groups > device.limits.max_groups[0] || desc.x.n > device.limits.max_groups[1])
        return unsupported(
            "group_norm: batch %u with %u groups, but the device takes at most %u and %u", desc.x.n,
            desc.groups, device.limits.max_groups[1], device.limits.max_groups[0]);
    return {};
}

std::uint64_t group_norm_sums_bytes(const GroupNormDesc& desc) {
    return std::uint64_t{desc.x.n} * desc.x.c * 8;
}

Status group_norm_forward(vk::Recorder& recorder, const GroupNormDesc& desc,
                          const vk::BufferView& x, const vk::BufferView& gamma,
                          const vk::BufferView& beta, const vk::BufferView& y,
                          const vk::BufferView& mean, const vk::BufferView& rstd) {
    SPLAT_TRY(group_norm_check(recorder.device(), desc));
    const vk::Kernels kernels = kernels_for(recorder, desc);
    const double elements = static_cast<double>(desc.x.n) * desc.x.c * desc.x.p;
    return recorder.dispatch({
        .op = "group_norm_forward",
        .shader = "group_norm_forward",
        .constants = {{params::kWorkgroupSizeId, lanes_for(recorder, desc, kernels)}},
        .push = params_of(desc, false),
        .accesses = {vk::read(x), vk::read(gamma), vk::read(beta), vk::write(y), vk::write(mean),
                     vk::write(rstd)},
        .groups = {desc.groups, desc.x.n, 1},
        .work = {.flops = (desc.silu ? 14.0 : 10.0) * elements, .bytes = 8.0 * elements},
        .may_alias = true,  // each group is read whole before it is written
        .kernels = kernels,
    });
}

Status group_norm_backward(vk::Recorder& recorder, const GroupNormDesc& desc,
                           const vk::BufferView& x, const vk::BufferView& gamma,
                           const vk::BufferView& beta, const vk::BufferView& mean,
                           const vk::BufferView& rstd, const vk::BufferView& grad_y,
                           const vk::BufferView& grad_x, const vk::BufferView& grad_gamma,
                           const vk::BufferView& grad_beta, const vk::BufferView& sums,
                           bool accumulate) {
    SPLAT_TRY(group_norm_check(recorder.device(), desc));
    const vk::Kernels kernels = kernels_for(recorder, desc);
    const double elements = static_cast<double>(desc.x.n) * desc.x.c * desc.x.p;
    SPLAT_TRY(recorder.dispatch({
        .op = "group_norm_backward",
        .shader = "group_norm_backward",
        .constants = {{params::kWorkgroupSizeId, lanes_for(recorder, desc, kernels)}},
        .push = params_of(desc, accumulate),
        .accesses = {vk::read(x), vk::read(gamma), vk::read(beta), vk::read(mean), vk::read(rstd),
                     vk::read(grad_y), vk::write(grad_x), vk::write(sums)},
        .groups = {desc.groups, desc.x.n, 1},
        .work = {.flops = (desc.silu ? 30.0 : 16.0) * elements, .bytes = 12.0 * elements},
        .may_alias = true,  // an element of grad_x is written by the invocation that read it last
        .kernels = kernels,
    }));
    if (grad_gamma.block == nullptr) return {};
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    return recorder.dispatch({
        .op = "group_norm_backward_params",
        .shader = "group_norm_backward_params",
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params_of(desc, accumulate),
        .accesses = {vk::read(sums), vk::read_write(grad_gamma), vk::read_write(grad_beta)},
        .groups = {(desc.x.c + size - 1) / size, 1, 1},
        .work = {.flops = 2.0 * desc.x.n * desc.x.c, .bytes = 8.0 * desc.x.n * desc.x.c},
    });
}

namespace {

constexpr Port kGroupNormInputs[] = {
    {"x"}, {"gamma", Layout::kRowMajor}, {"beta", Layout::kRowMajor}};
constexpr const char* kGroupNormSaved[] = {"mean", "rstd"};
constexpr Attribute kGroupNormAttributes[] = {
    {"groups", "integer", "1", "number of groups; divides the channels"},
    {"eps", "number", "1e-6", "added to the variance; > 0"},
    {"silu", "boolean", "false", "apply SiLU in the same pass"},
};

Result<GroupNormDesc> group_norm_desc(const Attributes& attributes, const Shape& x) {
    if (x.rank() < 2)
        return error(Code::kShape, "group_norm: tensor 'x' has shape %s, expected [N, C, ...]",
                     x.text().c_str());
    GroupNormDesc desc;
    SPLAT_ASSIGN(desc.x, quad_dims(x));
    const auto groups = attributes.integer("groups");
    if (groups < 1 || groups > desc.x.c)
        return invalid("group_norm: groups is %lld, expected 1 to %u", lld(groups), desc.x.c);
    desc.groups = static_cast<std::uint32_t>(groups);
    desc.eps = static_cast<float>(attributes.number("eps"));
    desc.silu = attributes.boolean("silu");
    return desc;
}

/// Offset of the workspace behind the sums.
std::uint64_t sums_end(const vk::Recorder& recorder, const GroupNormDesc& desc) {
    return round_up(group_norm_sums_bytes(desc), recorder.device().limits.offset_alignment);
}

Result<OpPlan> group_norm_plan(const vk::Recorder& recorder, const Attributes& attributes,
                               std::span<const Shape> inputs) {
    SPLAT_ASSIGN(const GroupNormDesc desc, group_norm_desc(attributes, inputs[0]));
    SPLAT_TRY(group_norm_check(recorder.device(), desc));
    SPLAT_TRY(expect_shape("group_norm", "gamma", inputs[1], {desc.x.c}));
    SPLAT_TRY(expect_shape("group_norm", "beta", inputs[2], {desc.x.c}));
    return OpPlan{.outputs = {inputs[0]},
                  .saved = {{2, desc.x.n, desc.groups}, {desc.x.n, desc.groups}},
                  .backward_workspace = sums_end(recorder, desc) + desc.x.bytes()};
}

Status group_norm_row_forward(vk::Recorder& recorder, const Attributes& attributes,
                              const OpViews& v) {
    SPLAT_ASSIGN(const GroupNormDesc desc, group_norm_desc(attributes, v.inputs[0].shape));
    return group_norm_forward(recorder, desc, v.inputs[0], v.inputs[1], v.inputs[2], v.outputs[0],
                              v.saved[0], v.saved[1]);
}

Status group_norm_row_backward(vk::Recorder& recorder, const Attributes& attributes,
                               const OpViews& v) {
    SPLAT_ASSIGN(const GroupNormDesc desc, group_norm_desc(attributes, v.inputs[0].shape));
    // If only one gradient of the pair is requested, the other is written behind the sums.
    const std::uint64_t end = sums_end(recorder, desc);
    const vk::BufferView sums = v.workspace.part(0, group_norm_sums_bytes(desc));
    const vk::BufferView& grad_gamma = v.grad_inputs[1];
    const vk::BufferView& grad_beta = v.grad_inputs[2];
    const vk::BufferView unwanted = v.workspace.part(end, vk::quad_bytes(desc.x.c));
    const bool parameters = present(grad_gamma) || present(grad_beta);
    return group_norm_backward(
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
    .forward = group_norm_row_forward,
    .backward = group_norm_row_backward};

}  // namespace splat::ops

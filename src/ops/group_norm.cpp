#include "ops/group_norm.h"

#include <cmath>

#include "ops/launch.h"
#include "params/group_norm_params.h"

namespace splat::ops {
namespace {

/// 1024 lanes loop over a group three times, each within kMaxTurns.
constexpr std::uint64_t kMaxGroupElements = 1024 * kMaxTurns;

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
            return workgroup_size(recorder.device(), 8, elements / 8);
        case vk::Kernels::kGpu:
            return workgroup_size(recorder.device(), 256, elements / 8);
        default:
            return workgroup_size(recorder.device(), 64, elements);
    }
}

}  // namespace

Status group_norm_check(const vk::DeviceInfo& device, const GroupNormDesc& desc) {
    if (desc.groups < 1 || desc.x.c % desc.groups != 0)
        return error(Code::kShape, "group_norm: %u channels do not divide into %u groups", desc.x.c,
                     desc.groups);
    if (!std::isfinite(desc.eps) || desc.eps <= 0)
        return error(Code::kInvalidArgument, "group_norm: eps is %g, expected a finite number > 0",
                     static_cast<double>(desc.eps));
    if (group_elements(desc) > kMaxGroupElements)
        return error(Code::kUnsupported,
                     "group_norm: a group of %llu elements, expected at most %llu: use more groups",
                     static_cast<unsigned long long>(group_elements(desc)),
                     static_cast<unsigned long long>(kMaxGroupElements));
    if (desc.groups > device.limits.max_groups[0] || desc.x.n > device.limits.max_groups[1])
        return error(Code::kUnsupported,
                     "group_norm: batch %u with %u groups, but the device takes at most %u and %u",
                     desc.x.n, desc.groups, device.limits.max_groups[1],
                     device.limits.max_groups[0]);
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
        .shader =
            pick(kernels, "group_norm_forward", "group_norm_forward_cpu", "group_norm_forward_gpu"),
        .constants = {{kWorkgroupSizeId, lanes_for(recorder, desc, kernels)}},
        .push = params_of(desc, false),
        .accesses = {vk::read(x), vk::read(gamma), vk::read(beta), vk::write(y), vk::write(mean),
                     vk::write(rstd)},
        .groups = {desc.groups, desc.x.n, 1},
        .work = {.flops = (desc.silu ? 14.0 : 10.0) * elements, .bytes = 8.0 * elements},
        .may_alias = true,  // each group is read whole before it is written
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
        .shader = pick(kernels, "group_norm_backward", "group_norm_backward_cpu",
                       "group_norm_backward_gpu"),
        .constants = {{kWorkgroupSizeId, lanes_for(recorder, desc, kernels)}},
        .push = params_of(desc, accumulate),
        .accesses = {vk::read(x), vk::read(gamma), vk::read(beta), vk::read(mean), vk::read(rstd),
                     vk::read(grad_y), vk::write(grad_x), vk::write(sums)},
        .groups = {desc.groups, desc.x.n, 1},
        .work = {.flops = (desc.silu ? 30.0 : 16.0) * elements, .bytes = 12.0 * elements},
        .may_alias = true,  // an element of grad_x is written by the invocation that read it last
    }));
    if (grad_gamma.block == nullptr) return {};
    const std::uint32_t size = workgroup_size(recorder.device(), 64);
    return recorder.dispatch({
        .op = "group_norm_backward_params",
        .shader = "group_norm_backward_params",
        .constants = {{kWorkgroupSizeId, size}},
        .push = params_of(desc, accumulate),
        .accesses = {vk::read(sums), vk::read_write(grad_gamma), vk::read_write(grad_beta)},
        .groups = {(desc.x.c + size - 1) / size, 1, 1},
        .work = {.flops = 2.0 * desc.x.n * desc.x.c, .bytes = 8.0 * desc.x.n * desc.x.c},
    });
}

}  // namespace splat::ops

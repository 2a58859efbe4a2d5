#include "ops/launch.h"

#include <algorithm>

#include "core/checked_math.h"

namespace splat::ops {
namespace {

constexpr std::uint32_t kMaxWorkgroup = 1024;

}  // namespace

const char* pick(vk::Kernels kernels, const char* plain, const char* cpu, const char* gpu) {
    switch (kernels) {
        case vk::Kernels::kCpu:
            return cpu;
        case vk::Kernels::kGpu:
            return gpu;
        default:
            return plain;
    }
}

std::uint32_t workgroup_size(const vk::DeviceInfo& device, std::uint32_t wanted) {
    const std::uint32_t most =
        std::min(device.limits.max_group_invocations, device.limits.max_group_size[0]);
    while (wanted > most) wanted /= 2;
    return wanted;
}

std::uint32_t workgroup_size(const vk::DeviceInfo& device, std::uint32_t wanted,
                             std::uint64_t items) {
    while (ceil_div(items, wanted) > kMaxTurns && wanted < kMaxWorkgroup) wanted *= 2;
    return workgroup_size(device, wanted);
}

vk::Groups groups_for(const vk::DeviceInfo& device, std::uint64_t count, std::uint32_t workgroup) {
    const std::uint64_t groups = ceil_div(count, workgroup);
    const std::uint64_t rows = ceil_div(groups, device.limits.max_groups[0]);
    return {static_cast<std::uint32_t>(ceil_div(groups, rows)), static_cast<std::uint32_t>(rows),
            1};
}

}  // namespace splat::ops

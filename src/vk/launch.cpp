#include "vk/launch.h"

#include <algorithm>

#include "core/checked_math.h"

namespace splat::vk {
namespace {

constexpr std::uint32_t kMaxWorkgroup = 1024;

}  // namespace

std::uint32_t workgroup_size(const DeviceInfo& device, std::uint32_t wanted) {
    const std::uint32_t most =
        std::min(device.limits.max_group_invocations, device.limits.max_group_size[0]);
    while (wanted > most) wanted /= 2;
    return wanted;
}

std::uint32_t workgroup_size(const DeviceInfo& device, std::uint32_t wanted, std::uint64_t items) {
    while (ceil_div(items, wanted) > kMaxTurns && wanted < kMaxWorkgroup) wanted *= 2;
    return workgroup_size(device, wanted);
}

Groups groups_for(const DeviceInfo& device, std::uint64_t count, std::uint32_t workgroup) {
    const std::uint64_t groups = ceil_div(count, workgroup);
    const std::uint64_t rows = ceil_div(groups, device.limits.max_groups[0]);
    return {static_cast<std::uint32_t>(ceil_div(groups, rows)), static_cast<std::uint32_t>(rows),
            1};
}

}  // namespace splat::vk

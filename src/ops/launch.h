#pragma once

#include "vk/recorder.h"

namespace splat::ops {

/// Specialisation ids that all shaders share.
inline constexpr std::uint32_t kWorkgroupSizeId = 0;

/// `wanted` invocations, or the greatest power of two below it that the device takes. `wanted` is a
/// power of two.
std::uint32_t workgroup_size(const vk::DeviceInfo& device, std::uint32_t wanted);

/// Workgroups for `count` invocations, in rows of at most the device's limit; shaders recover the
/// index as (gl_WorkGroupID.y * groups_x + gl_WorkGroupID.x) * gl_WorkGroupSize.x +
/// gl_LocalInvocationID.x and guard it.
vk::Groups groups_for(const vk::DeviceInfo& device, std::uint64_t count, std::uint32_t workgroup);

}  // namespace splat::ops

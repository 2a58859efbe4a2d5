#pragma once

#include "vk/recorder.h"

namespace splat::ops {

/// Specialisation ids that all shaders share.
inline constexpr std::uint32_t kWorkgroupSizeId = 0;

/// The name of the shader for the kernels in use.
const char* pick(vk::Kernels kernels, const char* plain, const char* cpu, const char* gpu);

/// The same for a kernel of two modules that differ in how they read and write: LOADS in
/// shaders/README.md.
inline const char* pick(vk::Kernels kernels, const char* plain, const char* cpu) {
    return pick(kernels, plain, cpu, plain);
}

/// `wanted` invocations, or the largest smaller power of two that the device allows. `wanted` is a power of
/// two.
std::uint32_t workgroup_size(const vk::DeviceInfo& device, std::uint32_t wanted);

/// At least `wanted` invocations for `items` that they share in loops: doubled until none takes more than
/// kMaxTurns, as far as the device allows. lavapipe silently ends an invocation's loops after 65535 turns
/// in all (Mesa's LP_MAX_TGSI_LOOP_ITERATIONS; seen with 22.3).
inline constexpr std::uint64_t kMaxTurns = 16384;
std::uint32_t workgroup_size(const vk::DeviceInfo& device, std::uint32_t wanted,
                             std::uint64_t items);

/// Workgroups for `count` invocations, in rows of at most the device's limit; shaders recover the
/// index as (gl_WorkGroupID.y * groups_x + gl_WorkGroupID.x) * gl_WorkGroupSize.x +
/// gl_LocalInvocationID.x and guard it.
vk::Groups groups_for(const vk::DeviceInfo& device, std::uint64_t count, std::uint32_t workgroup);

}  // namespace splat::ops

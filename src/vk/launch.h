#pragma once

#include "params/spec_ids.h"
#include "vk/recorder.h"

/// Sizes of dispatches, the same for operators and the rasterizer.
namespace splat::vk {

/// `wanted` invocations, or the greatest power of two below it that the device takes. `wanted` is a
/// power of two.
std::uint32_t workgroup_size(const DeviceInfo& device, std::uint32_t wanted);

/// At least `wanted` invocations for `items` that they share in loops: doubled until none has more
/// than kMaxTurns, where the device takes that many. lavapipe ends an invocation's loops, silently,
/// after 65535 turns in all (Mesa's LP_MAX_TGSI_LOOP_ITERATIONS; seen with 22.3).
inline constexpr std::uint64_t kMaxTurns = 16384;
std::uint32_t workgroup_size(const DeviceInfo& device, std::uint32_t wanted, std::uint64_t items);

/// Workgroups for `count` invocations, in rows of at most the device's limit; shaders recover the
/// index as (gl_WorkGroupID.y * groups_x + gl_WorkGroupID.x) * gl_WorkGroupSize.x +
/// gl_LocalInvocationID.x and guard it.
Groups groups_for(const DeviceInfo& device, std::uint64_t count, std::uint32_t workgroup);

}  // namespace splat::vk

#pragma once

#include <bit>

#include "shaders/test_spec_ids.h"
#include "support/expect_status.h"
#include "vk/context.h"

/// Dispatches of the shaders in tests/shaders, which this program's shader table holds instead of
/// the library's.
namespace splat::test {

inline constexpr std::uint32_t kGroupSize = 64;

struct ScaleParams {
    std::uint32_t n;
    float factor;
};

inline vk::Groups groups_of(std::uint32_t n) {
    return {(n + kGroupSize - 1) / kGroupSize, 1, 1};
}

/// y = factor * x + offset
inline vk::Dispatch scale(const vk::BufferView& x, const vk::BufferView& y, std::uint32_t n,
                          float factor, float offset = 0) {
    return {.op = "scale",
            .shader = "test_scale",
            .constants = {{params::kWorkgroupSizeId, kGroupSize},
                          {kTestOffsetId, std::bit_cast<std::uint32_t>(offset)}},
            .push = ScaleParams{n, factor},
            .accesses = {vk::read(x), vk::write(y)},
            .groups = groups_of(n),
            .work = {.flops = 2.0 * n, .bytes = 8.0 * n}};
}

/// y = 1 where factor * x is finite
inline vk::Dispatch finite(const vk::BufferView& x, const vk::BufferView& y, std::uint32_t n,
                           float factor) {
    return {.op = "finite",
            .shader = "test_finite",
            .constants = {{params::kWorkgroupSizeId, kGroupSize}},
            .push = ScaleParams{n, factor},
            .accesses = {vk::read(x), vk::write(y)},
            .groups = groups_of(n),
            .work = {.flops = 2.0 * n, .bytes = 8.0 * n}};
}

/// y += x
inline vk::Dispatch accumulate(const vk::BufferView& x, const vk::BufferView& y, std::uint32_t n) {
    return {.op = "accumulate",
            .shader = "test_accumulate",
            .constants = {{params::kWorkgroupSizeId, kGroupSize}},
            .push = n,
            .accesses = {vk::read(x), vk::read_write(y)},
            .groups = groups_of(n),
            .work = {.flops = 1.0 * n, .bytes = 12.0 * n}};
}

/// y = 1, by a kernel that has no plain module
inline vk::Dispatch ones(const vk::BufferView& y, std::uint32_t n) {
    return {.op = "ones",
            .shader = "test_ones",
            .constants = {{params::kWorkgroupSizeId, kGroupSize}},
            .push = n,
            .accesses = {vk::write(y)},
            .groups = groups_of(n),
            .work = {.flops = 0, .bytes = 4.0 * n}};
}

/// Flops of a kernel that are taken for `submits` times the longest submit, by what is known of it now.
inline double flops_for(vk::Context& context, double submits, const char* kernel = "test_slow") {
    vk::Device& device = context.device();
    const double one = vk::estimated_seconds(device.info(), device.kernels(), {.flops = 1e9}) *
                       device.pace.planned(device.pace.of(kernel), 0);
    return submits * device.pace.submit_seconds() / one * 1e9;
}

struct SlowParams {
    std::uint32_t width;
    std::uint32_t rounds;
};

/// y[group] = something that depends on the group's index alone
inline vk::Dispatch slow(const vk::BufferView& y, vk::Groups groups, std::uint32_t rounds,
                         double flops) {
    return {.op = "slow",
            .shader = "test_slow",
            .constants = {{params::kWorkgroupSizeId, 1}},
            .push = SlowParams{groups[0], rounds},
            .accesses = {vk::write(y)},
            .groups = groups,
            .work = {.flops = flops, .bytes = 4}};
}

/// y = 2 * x, in quads
inline vk::Dispatch texel(const vk::BufferView& x, const vk::BufferView& y, std::uint32_t quads) {
    return {.op = "texel",
            .shader = "test_texel",
            .constants = {{params::kWorkgroupSizeId, kGroupSize}},
            .push = quads,
            .accesses = {vk::read(x), vk::write(y)},
            .groups = groups_of(quads),
            .work = {.flops = 4.0 * quads, .bytes = 32.0 * quads}};
}

/// y[0] = number of workgroups
inline vk::Dispatch count_groups(const vk::BufferView& y, std::uint32_t groups, double flops) {
    return {.op = "count_groups",
            .shader = "test_count_groups",
            .constants = {{params::kWorkgroupSizeId, 1}},
            .push = {},
            .accesses = {vk::write(y)},
            .groups = {groups, 1, 1},
            .work = {.flops = flops, .bytes = 4}};
}

/// y[index] = 1, wherever that is
inline vk::Dispatch out_of_range(const vk::BufferView& y, std::uint32_t index) {
    return {.op = "out_of_range",
            .shader = "test_out_of_range",
            .constants = {},
            .push = index,
            .accesses = {vk::write(y)},
            .groups = {1, 1, 1},
            .work = {.flops = 0, .bytes = 4}};
}

/// `bytes` of `view` from byte `offset` on.
inline vk::BufferView part(const vk::BufferView& view, std::uint64_t offset, std::uint64_t bytes) {
    vk::BufferView result = view;
    result.offset += offset;
    result.bytes = bytes;
    return result;
}

/// The list of these dispatches.
inline vk::CommandList record(vk::Context& context, const std::vector<vk::Dispatch>& dispatches) {
    vk::Recorder recorder(context);
    for (const vk::Dispatch& dispatch : dispatches) EXPECT_OK(recorder.dispatch(dispatch));
    return need(recorder.finish());
}

}  // namespace splat::test

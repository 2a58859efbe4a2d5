#pragma once

#include <bit>

#include "vk/recorder.h"

/// Dispatches of the shaders in tests/shaders, which this program's shader table holds instead of the library's.
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
            .constants = {{0, kGroupSize}, {10, std::bit_cast<std::uint32_t>(offset)}},
            .push = ScaleParams{n, factor},
            .accesses = {vk::read(x), vk::write(y)},
            .groups = groups_of(n)};
}

/// y += x
inline vk::Dispatch accumulate(const vk::BufferView& x, const vk::BufferView& y, std::uint32_t n) {
    return {.op = "accumulate",
            .shader = "test_accumulate",
            .constants = {{0, kGroupSize}},
            .push = n,
            .accesses = {vk::read(x), vk::read_write(y)},
            .groups = groups_of(n)};
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
            .constants = {{0, 1}},
            .push = SlowParams{groups[0], rounds},
            .accesses = {vk::write(y)},
            .groups = groups,
            .work = {.flops = flops}};
}

/// `bytes` of `view` from byte `offset` on.
inline vk::BufferView part(const vk::BufferView& view, std::uint64_t offset, std::uint64_t bytes) {
    vk::BufferView result = view;
    result.offset += offset;
    result.bytes = bytes;
    return result;
}

}  // namespace splat::test

#include "ops/tensor_stats.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "core/checked_math.h"
#include "params/tensor_stats_params.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

/// Elements per workgroup: enough to hide its start, and below 2^24 so that counts in float are exact.
constexpr std::uint32_t kChunk = 16384;
constexpr std::size_t kWordsPerChunk = 8;

}  // namespace

std::uint64_t tensor_stats_partial_bytes(std::uint64_t elements) {
    return ceil_div(elements, kChunk) * kWordsPerChunk * 4;
}

Status tensor_stats(vk::Recorder& recorder, std::uint64_t elements, const vk::BufferView& x,
                    const vk::BufferView& partial) {
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups groups = vk::groups_for(recorder.device(), ceil_div(elements, kChunk), 1);
    return recorder.dispatch({
        .op = "tensor_stats",
        .shader = "tensor_stats",
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params::TensorStatsParams{static_cast<std::uint32_t>(elements), kChunk, groups[0]},
        .accesses = {vk::read(x), vk::write(partial)},
        .groups = groups,
        .work = {.flops = 4.0 * static_cast<double>(elements),
                 .bytes = 8.0 * static_cast<double>(elements)},
    });
}

TensorStats tensor_stats_merge(std::span<const std::uint32_t> partial) {
    const auto real = [&](std::size_t at) {
        return static_cast<double>(std::bit_cast<float>(partial[at]));
    };
    TensorStats stats;
    stats.min = std::numeric_limits<double>::infinity();
    stats.max = -std::numeric_limits<double>::infinity();
    double sum = 0;
    std::uint64_t finite = 0;
    for (std::size_t at = 0; at + kWordsPerChunk <= partial.size(); at += kWordsPerChunk) {
        const std::uint32_t count = partial[at + 4];
        stats.min = std::min(stats.min, real(at));
        stats.max = std::max(stats.max, real(at + 1));
        sum += 2 * real(at + 2) * count;
        finite += count;
        stats.nan_count += partial[at + 5];
        stats.inf_count += partial[at + 6];
    }
    if (finite > 0) stats.mean = sum / static_cast<double>(finite);
    return stats;
}

}  // namespace splat::ops

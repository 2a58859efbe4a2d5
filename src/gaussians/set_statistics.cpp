#include "gaussians/set_statistics.h"

#include "core/checked_math.h"
#include "params/tensor_stats_params.h"
#include "vk/launch.h"

namespace splat::gaussians {
namespace {

/// Gaussians per workgroup: enough to hide its start, and few enough that counts in float are exact.
constexpr std::uint32_t kChunk = 1024;

}  // namespace

std::uint64_t set_statistics_bytes(std::uint32_t gaussians) {
    return std::uint64_t{16} * ceil_div(gaussians, kChunk);
}

Status set_statistics(vk::Recorder& recorder, const SetDesc& desc, const SetViews& set,
                      const vk::BufferView& partial) {
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups groups = vk::groups_for(recorder.device(), ceil_div(set.count, kChunk), 1);
    const double quads = set.count * (kGaussianFloats / 4.0 + desc.color_quads());
    return recorder.dispatch({
        .op = "set_statistics",
        .shader = "set_statistics",
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params::SetStatisticsParams{set.count, desc.color_quads(), kChunk, groups[0]},
        .accesses = {vk::read(set.gaussians), vk::read(set.colors), vk::write(partial)},
        .groups = groups,
        .work = {.flops = 8 * quads, .bytes = 16 * quads},
    });
}

SetStatistics set_statistics_sum(std::span<const std::uint32_t> partial) {
    SetStatistics sum;
    for (std::size_t at = 0; at + 4 <= partial.size(); at += 4) {
        sum.numbers_not_finite += partial[at];
        sum.not_finite += partial[at + 1];
        sum.faint += partial[at + 2];
        sum.invisible += partial[at + 3];
    }
    return sum;
}

}  // namespace splat::gaussians

#include "ops/winograd_slices.h"

#include <algorithm>

#include "core/checked_math.h"
#include "ops/gpu_tiles.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

/// V and M of a slice together: on CPU devices they should stay in the cache (256 tiles of 128 + 128
/// channels were 15 % faster than 1024); a GPU needs work for all its processors.
constexpr std::uint64_t kCpuSliceBytes = std::uint64_t{9} << 20;
constexpr std::uint64_t kGpuSliceBytes = std::uint64_t{96} << 20;

/// From this many tiles on, register tiles are square, which needs the fewest fetches per product; below, they are
/// tall, which leaves few lanes idle.
constexpr std::uint32_t kSquareFrom = 64;

struct RegisterTile {
    std::uint32_t columns;
    std::uint32_t blocks;
    std::uint32_t depth;
};

/// Register tile of the product on CPU devices. Wide and two quads deep takes the fewest instructions, because it
/// touches its sums half as often: 1.2 times as fast on Zen 5. But it unrolls to 21 KiB of code: two quads of as many
/// sums made a Zen 3 core, which has 16 registers, a sixth slower, and a Skylake server no faster. Large unrolls to
/// twice that, with three fetches instead of five: a tenth faster on a Xeon whose instruction cache holds it.
RegisterTile cpu_tile(const vk::DeviceFeatures& cpu, std::uint32_t tiles) {
    constexpr RegisterTile kTall{2, 8, 1}, kSquare{4, 4, 1}, kWide{8, 2, 2}, kLarge{8, 4, 2};
    if (tiles < kSquareFrom) return kTall;
    const std::uint64_t idle = round_up(tiles, 8 * kWide.columns) - tiles;
    if (!cpu.many_registers || 8 * idle > tiles) return kSquare;
    return cpu.large_code_cache ? kLarge : kWide;
}

}  // namespace

std::uint32_t winograd_places(const Conv2dDesc& desc) {
    return static_cast<std::uint32_t>((desc.winograd + 2) * (desc.winograd + 2));
}

std::uint32_t WinogradSlices::groups(std::uint32_t count) const {
    return static_cast<std::uint32_t>(ceil_div(count, std::uint64_t{lanes} * columns)) * columns;
}

std::uint64_t WinogradSlices::bytes(const Conv2dDesc& desc, std::uint32_t channels) const {
    return std::uint64_t{winograd_places(desc)} * round_up(channels, 8) * tiles * 4;
}

WinogradSlices winograd_slices(const vk::Recorder& recorder, const Conv2dDesc& desc) {
    const bool cpu = recorder.kernels() == vk::Kernels::kCpu;
    const params::Conv2dWinogradParams params = winograd_params(desc);
    WinogradSlices slices{};
    slices.all = desc.n * params.tiles_x * params.tiles_y;
    slices.lanes = cpu ? 8 : vk::workgroup_size(recorder.device(), 64);
    const RegisterTile tile =
        cpu ? cpu_tile(recorder.device().features, slices.all) : RegisterTile{1, 1, 1};
    slices.columns = tile.columns;
    slices.blocks = tile.blocks;
    slices.depth = tile.depth;
    const std::uint64_t step = std::uint64_t{slices.lanes} * slices.columns;
    const std::uint64_t channels = round_up(desc.in_channels, 8) + round_up(desc.out_channels, 8);
    const std::uint64_t most = std::max<std::uint64_t>(
        (cpu ? kCpuSliceBytes : kGpuSliceBytes) / (4 * winograd_places(desc) * channels) / step, 1);
    const std::uint64_t steps = ceil_div(slices.all, step);
    const std::uint64_t count = ceil_div(steps, most);
    slices.tiles = static_cast<std::uint32_t>(ceil_div(steps, count) * step);
    return slices;
}

std::vector<vk::SpecConstant> winograd_transform(const vk::Recorder& recorder,
                                                 const Conv2dDesc& desc,
                                                 const WinogradSlices& slices) {
    std::vector<vk::SpecConstant> constants = {{params::kWorkgroupSizeId, slices.lanes},
                                               winograd_tile(desc)};
    if (recorder.kernels() == vk::Kernels::kGpu)
        constants.push_back(
            {params::kWinogradPartsId, gpu_tiles(recorder.device()).winograd_quads});
    return constants;
}

std::uint32_t winograd_parts(const vk::Recorder& recorder, std::uint32_t channels) {
    const auto octets = static_cast<std::uint32_t>(ceil_div(channels, 8));
    const bool gpu = recorder.kernels() == vk::Kernels::kGpu;
    return gpu ? 2 * octets / gpu_tiles(recorder.device()).winograd_quads : octets;
}

params::Conv2dWinogradParams winograd_params(const Conv2dDesc& desc) {
    const auto tile = static_cast<std::uint32_t>(desc.winograd);
    params::Conv2dWinogradParams params{};
    params.n = desc.n;
    params.in_channels = desc.in_channels;
    params.out_channels = desc.out_channels;
    params.height = desc.height;
    params.width = desc.width;
    params.tiles_x = static_cast<std::uint32_t>(ceil_div(desc.width, tile));
    params.tiles_y = static_cast<std::uint32_t>(ceil_div(desc.height, tile));
    params.has_bias = desc.bias ? 1 : 0;
    params.scale = desc.scale;
    params.slices = 1;
    params.places = winograd_places(desc);
    params.one = 1;
    return params;
}

}  // namespace splat::ops

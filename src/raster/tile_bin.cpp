#include "raster/tile_bin.h"

#include <algorithm>
#include <bit>

#include "core/checked_math.h"
#include "ops/launch.h"
#include "params/tile_bin_params.h"

namespace splat::raster {
namespace {

constexpr std::uint32_t kGroup = 64;

std::uint32_t tiles_of(const RasterDesc& desc, const Window& window) {
    return desc.tiles_x() * window.rows() * desc.views;
}

params::TileBinParams params_of(const vk::Recorder& recorder, const RasterDesc& desc,
                                const Window& window) {
    params::TileBinParams params{};
    params.gaussians = desc.gaussians;
    params.items = static_cast<std::uint32_t>(desc.items());
    params.lanes = tile_bin_lanes(recorder, desc);
    params.width = desc.width;
    params.height = desc.height;
    params.row_begin = window.row_begin;
    params.row_end = window.row_end;
    params.tiles = tiles_of(desc, window);
    params.flags = desc.flags();
    params.emit_group = ops::workgroup_size(recorder.device(), kGroup);
    params.max_groups = recorder.device().limits.max_groups[0];
    return params;
}

}  // namespace

std::uint32_t tile_bin_lanes(const vk::Recorder& recorder, const RasterDesc& desc) {
    // Chunks of 64 or more, few enough lanes that one invocation can scan their sums.
    const auto items = static_cast<std::uint32_t>(std::max<std::uint64_t>(desc.items(), 1));
    const auto least =
        std::bit_ceil(static_cast<std::uint32_t>(ceil_div(std::uint64_t{items}, ops::kMaxTurns)));
    const std::uint32_t most = recorder.kernels() == vk::Kernels::kCpu ? 512 : 4096;
    return std::max(std::clamp(std::bit_ceil(items / 64), 64U, most), least);
}

std::uint32_t tile_key_bits(const RasterDesc& desc, const Window& window) {
    return static_cast<std::uint32_t>(std::bit_width(std::max(tiles_of(desc, window), 2U) - 1));
}

Status tile_bin(vk::Recorder& recorder, const RasterDesc& desc, const TileBinDesc& bin,
                const TileBinViews& views) {
    params::TileBinParams params = params_of(recorder, desc, bin.window);
    params.capacity = bin.capacity;
    const vk::Kernels kernels = recorder.kernels();
    const std::uint32_t scan_group = ops::workgroup_size(recorder.device(), 8);
    const vk::Groups scan_groups = {params.lanes / scan_group, 1, 1};
    const auto items = static_cast<double>(desc.items());
    SPLAT_TRY(recorder.dispatch({
        .op = "tile_bin",
        .shader = ops::pick(kernels, "tile_bin_reduce", "tile_bin_reduce_cpu", "tile_bin_reduce"),
        .constants = {{ops::kWorkgroupSizeId, scan_group}},
        .push = params,
        .accesses = {vk::read(views.counts), vk::read(views.order), vk::read(views.sorted),
                     vk::write(views.sums)},
        .groups = scan_groups,
        .work = {.flops = items, .bytes = 8 * items},
    }));
    SPLAT_TRY(recorder.dispatch({
        .op = "tile_bin",
        .shader = "tile_bin_scan",
        .constants = {{ops::kWorkgroupSizeId, 1}},
        .push = params,
        .accesses = {vk::read_write(views.sums), vk::read(views.sorted), vk::write(views.stats),
                     vk::write(views.groups), vk::write(views.pair_count)},
        .work = {.flops = double{1} * params.lanes, .bytes = 8.0 * params.lanes},
    }));
    SPLAT_TRY(recorder.dispatch({
        .op = "tile_bin",
        .shader =
            ops::pick(kernels, "tile_bin_offsets", "tile_bin_offsets_cpu", "tile_bin_offsets"),
        .constants = {{ops::kWorkgroupSizeId, scan_group}},
        .push = params,
        .accesses = {vk::read(views.counts), vk::read(views.order), vk::read(views.sorted),
                     vk::read(views.sums), vk::write(views.begins)},
        .groups = scan_groups,
        .work = {.flops = items, .bytes = 12 * items},
    }));
    return recorder.dispatch_indirect(
        {
            .op = "tile_bin",
            .shader = ops::pick(kernels, "tile_bin_emit", "tile_bin_emit_cpu", "tile_bin_emit"),
            .constants = {{ops::kWorkgroupSizeId, params.emit_group}},
            .push = params,
            .accesses = {vk::read(views.splats), vk::read(views.counts), vk::read(views.begins),
                         vk::read(views.order), vk::read(views.stats), vk::write(views.keys),
                         vk::write(views.items)},
            .work = {.flops = 100 * items, .bytes = 48 * items + 8.0 * bin.capacity},
        },
        views.groups);
}

Status tile_ranges(vk::Recorder& recorder, const RasterDesc& desc, const Window& window,
                   const vk::BufferView& keys, const vk::BufferView& sorted,
                   const vk::BufferView& ranges, const vk::BufferView& stats) {
    params::TileBinParams params = params_of(recorder, desc, window);
    const std::uint32_t group = ops::workgroup_size(recorder.device(), kGroup);
    const vk::Groups groups = ops::groups_for(recorder.device(), params.tiles, group);
    params.groups_x = groups[0];
    return recorder.dispatch({
        .op = "tile_ranges",
        .shader = ops::pick(recorder.kernels(), "tile_ranges", "tile_ranges_cpu", "tile_ranges"),
        .constants = {{ops::kWorkgroupSizeId, group}},
        .push = params,
        .accesses = {vk::read(keys), vk::read(sorted), vk::write(ranges), vk::read_write(stats)},
        .groups = groups,
        .work = {.flops = 100.0 * params.tiles, .bytes = 200.0 * params.tiles},
    });
}

}  // namespace splat::raster

#include "raster/tile_bin.h"

#include <algorithm>
#include <bit>

#include "core/checked_math.h"
#include "params/project_params.h"
#include "params/tile_bin_params.h"
#include "raster/radix_sort.h"
#include "vk/launch.h"

namespace splat::raster {
namespace {

constexpr std::uint32_t kBinGroup = 64;
/// Scans on GPUs take 16 entries an invocation.
constexpr std::uint32_t kScanGroup = 256;
constexpr std::uint32_t kScanChunk = 16 * kScanGroup;
constexpr std::uint32_t kMaxOrderedTiles = 512;

/// Most entries of a chunk on CPU devices, where a workgroup of 8 lanes walks it and lavapipe ends
/// its loops after 65535 turns in all. Reading the sums takes one turn per 16 chunks, of which
/// there are at most 32768 (a power of two below 65536 workgroups). 8 entries take one turn, one
/// more per tile of their largest packed footprint (6 by 15 tiles,
/// shaders/include/raster/tile_footprint.glsl), and one more if the chunk has larger ones.
constexpr std::uint64_t kMaxChunks = 32768;
constexpr std::uint64_t kMaxChunk = (65535 - kMaxChunks / 16) / (2 + 6 * 15) * 8;
static_assert(kMaxSorted <= kMaxChunks * kMaxChunk);

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
    params.views = desc.views;
    return params;
}

/// Large footprints per invocation. CPU devices take up to 128, since an idle group is expensive
/// there, but no more than kMaxWindowTiles allows if each covers the whole window.
std::uint64_t large_share(const vk::Recorder& recorder, const RasterDesc& desc,
                          const Window& window) {
    if (recorder.kernels(vk::Family::kSort) != vk::Kernels::kCpu) return 1;
    const std::uint64_t tiles = std::uint64_t{desc.tiles_x()} * window.rows();
    return std::clamp<std::uint64_t>(kMaxWindowTiles / tiles, 1, 128);
}

/// Exclusive sums of the tile counts, in order of depth or of index. The sum by depth also decides
/// whether this pass draws. On CPU devices only the sums of the chunks are made by depth, and
/// `emit` decides.
Status scan_counts(vk::Recorder& recorder, const params::TileBinParams& params,
                   const TileBinViews& views, bool by_index) {
    const vk::Kernels kernels = recorder.kernels(vk::Family::kSort);
    const bool cpu = kernels == vk::Kernels::kCpu, gpu = kernels == vk::Kernels::kGpu;
    const std::uint32_t group = gpu ? kScanGroup : vk::workgroup_size(recorder.device(), 8);
    const vk::Groups groups = {gpu ? params.lanes : params.lanes / group, 1, 1};
    const std::vector<vk::SpecConstant> constants = {
        {params::kWorkgroupSizeId, group}, {params::kTileBinByIndexId, by_index ? 1U : 0U}};
    const double items = params.items;
    std::vector<vk::Access> accesses = {vk::read(views.counts), vk::read(views.order),
                                        vk::read(views.sorted), vk::write(views.sums)};
    if (!cpu) accesses.push_back(vk::write(views.large));
    SPLAT_TRY(recorder.dispatch({
        .op = "tile_bin",
        .shader = "tile_bin_reduce",
        .constants = constants,
        .push = params,
        .accesses = accesses,
        .groups = cpu ? vk::Groups{params.lanes, 1, 1} : groups,
        .work = {.flops = items, .bytes = (by_index ? 4 : 16) * items},
        .kernels = kernels,
    }));
    if (cpu && !by_index) return {};
    SPLAT_TRY(recorder.dispatch({
        .op = "tile_bin",
        .shader = "tile_bin_scan",
        .constants = {{params::kWorkgroupSizeId, gpu ? group : 1},
                      {params::kTileBinByIndexId, by_index ? 1U : 0U}},
        .push = params,
        .accesses = {vk::read_write(views.sums), vk::read(views.sorted), vk::write(views.stats),
                     vk::write(views.pair_count)},
        .work = {.flops = double{1} * params.lanes, .bytes = 8.0 * params.lanes},
        .kernels = kernels,
    }));
    return recorder.dispatch({
        .op = "tile_bin",
        .shader = "tile_bin_offsets",
        .constants = constants,
        .push = params,
        .accesses = {vk::read(by_index ? views.counts : views.large), vk::read(views.sorted),
                     vk::read(views.sums), vk::write(by_index ? views.slot_begins : views.begins)},
        .groups = groups,
        .work = {.flops = items, .bytes = 8 * items},
        .kernels = kernels,
    });
}

/// Write the pairs of all packed footprints.
Status emit(vk::Recorder& recorder, const RasterDesc& desc, params::TileBinParams params,
            const TileBinViews& views) {
    const bool cpu = recorder.kernels(vk::Family::kSort) == vk::Kernels::kCpu;
    const std::uint32_t group = vk::workgroup_size(recorder.device(), cpu ? 8 : kBinGroup);
    const vk::Groups groups = cpu ? vk::Groups{params.lanes, 1, 1}
                                  : vk::groups_for(recorder.device(), desc.items(), group);
    params.groups_x = groups[0];
    const auto items = static_cast<double>(desc.items());
    std::vector<vk::Access> accesses = {
        vk::read(views.order),       vk::read(cpu ? views.sums : views.begins),
        vk::read(views.slot_begins), vk::read(views.footprints),
        vk::write(views.pairs),      vk::write(views.slots),
        vk::write(views.large),      vk::read_write(views.stats)};
    if (cpu) {
        accesses.push_back(vk::read(views.sorted));
        accesses.push_back(vk::write(views.pair_count));
    }
    return recorder.dispatch({
        .op = "tile_bin",
        .shader = "tile_bin_emit",
        .constants = {{params::kWorkgroupSizeId, group},
                      {params::kTileBinSlotsId, desc.backward ? 1U : 0U}},
        .push = params,
        .accesses = accesses,
        .groups = groups,
        .work = {.flops = 200 * items, .bytes = 32 * items + 12.0 * params.capacity},
        .kernels = recorder.kernels(vk::Family::kSort),
    });
}

}  // namespace

std::uint32_t tile_bin_lanes(const vk::Recorder& recorder, const RasterDesc& desc) {
    // Chunks have 64 entries or more, so that one invocation can scan their sums; on CPU devices,
    // where each is a workgroup, 256 or more. GPUs read sums in quads.
    const bool cpu = recorder.kernels(vk::Family::kSort) == vk::Kernels::kCpu;
    const auto items = static_cast<std::uint32_t>(std::max<std::uint64_t>(desc.items(), 1));
    if (recorder.kernels(vk::Family::kSort) == vk::Kernels::kGpu)
        return (items + 4 * kScanChunk - 1) / (4 * kScanChunk) * 4;
    const auto least = std::bit_ceil(static_cast<std::uint32_t>(
        ceil_div(std::uint64_t{items}, cpu ? kMaxChunk : vk::kMaxTurns)));
    const std::uint32_t most = cpu ? 512 : 4096;
    return std::max(std::clamp(std::bit_ceil(items / (cpu ? 512 : 64)), 64U, most), least);
}

std::uint32_t tile_key_bits(const RasterDesc& desc, const Window& window) {
    return static_cast<std::uint32_t>(std::bit_width(std::max(tiles_of(desc, window), 2U) - 1));
}

Status tile_bin(vk::Recorder& recorder, const RasterDesc& desc, const TileBinDesc& bin,
                const TileBinViews& views) {
    params::TileBinParams params = params_of(recorder, desc, bin.window);
    params.capacity = bin.capacity;
    const auto items = static_cast<double>(desc.items());
    if (desc.backward) SPLAT_TRY(scan_counts(recorder, params, views, true));
    SPLAT_TRY(scan_counts(recorder, params, views, false));  // last: `emit` needs these sums
    SPLAT_TRY(emit(recorder, desc, params, views));
    const std::uint32_t group = vk::workgroup_size(recorder.device(), kBinGroup);
    const std::uint64_t share = large_share(recorder, desc, bin.window);
    const vk::Groups large_groups =
        vk::groups_for(recorder.device(), ceil_div(desc.items(), share), group);
    params.groups_x = large_groups[0];
    params.stride = group * large_groups[0] * large_groups[1];
    return recorder.dispatch({
        .op = "tile_bin",
        .shader = "tile_bin_emit_large",
        .constants = {{params::kWorkgroupSizeId, group},
                      {params::kTileBinSlotsId, desc.backward ? 1U : 0U},
                      {params::kProjectFlagsId, desc.flags()}},
        .push = params,
        .accesses = {vk::read(views.splats), vk::read(views.large), vk::read(views.slot_begins),
                     vk::read(views.stats), vk::read(views.footprints), vk::write(views.counts),
                     vk::write(views.pairs), vk::write(views.slots), vk::read(views.background),
                     vk::read(views.active_tiles), vk::read(views.view_ranges)},
        .groups = large_groups,
        .work = {.flops = 20 * items, .bytes = 12.0 * bin.capacity},
    });
}

bool tile_order_used(const vk::Recorder& recorder, const RasterDesc& desc, const Window& window) {
    const std::uint32_t most = vk::workgroup_size(recorder.device(), kMaxOrderedTiles);
    return recorder.kernels(vk::Family::kSort) == vk::Kernels::kCpu &&
           tiles_of(desc, window) <= most;
}

Status tile_ranges(vk::Recorder& recorder, const RasterDesc& desc, const Window& window,
                   const vk::BufferView& pairs, const vk::BufferView& sorted,
                   const TileRanges& to) {
    params::TileBinParams params = params_of(recorder, desc, window);
    const double tiles = params.tiles;
    if (tile_order_used(recorder, desc, window))
        return recorder.dispatch({
            .op = "tile_ranges",
            .shader = "tile_ranges_ordered",
            .constants = {{params::kWorkgroupSizeId, std::max(std::bit_ceil(params.tiles), 8U)}},
            .push = params,
            .accesses = {vk::read(pairs), vk::read(sorted), vk::write(to.ranges),
                         vk::read_write(to.stats), vk::write(to.order)},
            .work = {.flops = 100 * tiles + 10 * tiles * tiles, .bytes = 200 * tiles},
            .kernels = vk::Kernels::kCpu,
        });
    const std::uint32_t group = vk::workgroup_size(recorder.device(), kBinGroup);
    const vk::Groups groups = vk::groups_for(recorder.device(), params.tiles, group);
    params.groups_x = groups[0];
    return recorder.dispatch({
        .op = "tile_ranges",
        .shader = "tile_ranges",
        .constants = {{params::kWorkgroupSizeId, group}},
        .push = params,
        .accesses = {vk::read(pairs), vk::read(sorted), vk::write(to.ranges),
                     vk::read_write(to.stats)},
        .groups = groups,
        .work = {.flops = 100 * tiles, .bytes = 200 * tiles},
    });
}

}  // namespace splat::raster

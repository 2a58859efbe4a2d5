#pragma once

#include "raster/raster_desc.h"
#include "vk/recorder.h"

namespace splat::raster {

/// A (tile, Gaussian) pair is an intersection; the arrays hold `capacity` of them.
struct TileBinDesc {
    std::uint32_t capacity = 0;
    Window window;
};

struct TileBinViews {
    vk::BufferView splats;  ///< of project_forward
    vk::BufferView counts;
    vk::BufferView footprints;
    vk::BufferView order;   ///< [V*N,2] uint32: depth, item; by depth
    vk::BufferView sorted;  ///< uint32: their number
    vk::BufferView sums;    ///< tile_bin_lanes uint32, workspace
    vk::BufferView begins;  ///< [V*N] uint32, workspace: first pair of an entry of `order`, on CPU
                            ///< devices of those with large footprints alone
    vk::BufferView slot_begins;  ///< [V*N] uint32, out with desc.backward: its first record
    vk::BufferView pairs;        ///< [capacity,2] uint32, out: tile, item
    vk::BufferView slots;        ///< [capacity] uint32, out with desc.backward: record
    vk::BufferView large;  ///< [V*N] uint32, workspace: counts by depth (not on CPU devices), then
                           ///< entries with large footprints
    vk::BufferView pair_count;  ///< uint32, out: pairs made
    vk::BufferView stats;       ///< kStatWords uint32, out
};

std::uint32_t tile_bin_lanes(const vk::Recorder& recorder, const RasterDesc& desc);

/// Bits of a tile's index, all views.
std::uint32_t tile_key_bits(const RasterDesc& desc, const Window& window);

/// One pair per tile that a Gaussian reaches, in depth order. More pairs than `capacity`: none, and
/// stats says how many there are. Records of the backward pass are by index, so that what reads them
/// goes through memory in order.
///
/// Errors       the recorder's
/// Determinism  bit-exact for any thread count
/// Source       shaders/include/tile_footprint.glsl
Status tile_bin(vk::Recorder& recorder, const RasterDesc& desc, const TileBinDesc& bin,
                const TileBinViews& views);

struct TileRanges {
    vk::BufferView
        ranges;  ///< [tiles,2] uint32, out: each tile's part [first, last) of the sorted pairs
    vk::BufferView order;  ///< [tiles] uint32, out where tile_order_used: tiles so that runs of
                           ///< workgroups take about equally long; no result depends on it
    vk::BufferView stats;  ///< kStatWords uint32, in place
};

/// Whether the blending kernels take their tiles in such an order: of few tiles one may outweigh many,
/// and ranking takes a time that grows with their square. CPU devices only.
bool tile_order_used(const vk::Recorder& recorder, const RasterDesc& desc, const Window& window);

/// Where each tile's list lies among the pairs [capacity,2] (tile, item), `sorted` of them by tile.
Status tile_ranges(vk::Recorder& recorder, const RasterDesc& desc, const Window& window,
                   const vk::BufferView& pairs, const vk::BufferView& sorted, const TileRanges& to);

}  // namespace splat::raster

#pragma once

#include "raster/raster_desc.h"
#include "vk/recorder.h"

namespace splat::raster {

/// A pair is a tile and a Gaussian that reaches it. The arrays hold `capacity` pairs.
struct TileBinDesc {
    std::uint32_t capacity = 0;
    Window window;
};

struct TileBinViews {
    vk::BufferView splats;  ///< output of project_forward
    vk::BufferView counts;
    vk::BufferView footprints;
    vk::BufferView order;        ///< [V*N,2] uint32: depth, item; by depth
    vk::BufferView sorted;       ///< uint32: their number
    vk::BufferView sums;         ///< tile_bin_lanes uint32, workspace
    vk::BufferView begins;       ///< [V*N] uint32, workspace: first pair of each entry of `order`;
                                 ///< unused by kernels for CPUs
    vk::BufferView slot_begins;  ///< [V*N] uint32, out with desc.backward: first record
    vk::BufferView pairs;        ///< [capacity,2] uint32, out: tile, item
    vk::BufferView slots;        ///< [capacity] uint32, out with desc.backward: record
    vk::BufferView large;        ///< [V*N,2] uint32, workspace: counts by depth (not by kernels for
                                 ///< CPUs), then items with large footprints and their first pairs
    vk::BufferView pair_count;   ///< uint32, out: pairs made
    vk::BufferView stats;        ///< kStatWords uint32, in place: kStatLarge is 0 before
    vk::BufferView background, active_tiles, view_ranges;  ///< see CallViews
};

std::uint32_t tile_bin_lanes(const vk::Recorder& recorder, const RasterDesc& desc);

/// Bits of a tile's index in the window, all views.
std::uint32_t tile_key_bits(const RasterDesc& desc, const Window& window);

/// Write one pair per tile that a Gaussian reaches, in depth order. If there are more than
/// `capacity`, write none and count them in stats. Records of the backward pass are ordered by
/// item, so that their reader goes through memory in order.
///
/// Errors       the recorder's
/// Determinism  bit-exact for any thread count
/// Source       shaders/include/raster/tile_footprint.glsl
Status tile_bin(vk::Recorder& recorder, const RasterDesc& desc, const TileBinDesc& bin,
                const TileBinViews& views);

struct TileRanges {
    vk::BufferView
        ranges;  ///< [tiles,2] uint32, out: each tile's part [first, last) of the sorted pairs
    vk::BufferView order;  ///< [tiles] uint32, out if tile_order_used: an order in which contiguous
                           ///< runs of tiles take about equally long; no result depends on it
    vk::BufferView stats;  ///< kStatWords uint32, in place
};

/// True if the blending kernels use TileRanges::order: on CPU devices, if there are few tiles. One
/// tile may then outweigh many, and the time for ranking grows with the square of their number.
bool tile_order_used(const vk::Recorder& recorder, const RasterDesc& desc, const Window& window);

/// Find each tile's list among the `sorted` pairs [capacity,2] (tile, item), which are in order of
/// tiles.
Status tile_ranges(vk::Recorder& recorder, const RasterDesc& desc, const Window& window,
                   const vk::BufferView& pairs, const vk::BufferView& sorted, const TileRanges& to);

}  // namespace splat::raster

#pragma once

#include "raster/blend.h"
#include "raster/radix_sort.h"
#include "raster/tile_bin.h"
#include "vk/context.h"

namespace splat::raster {

/// Device memory of one Rasterizer. Item arrays have a fixed size, pair arrays grow.
class Workspace {
  public:
    /// Errors: those of Memory::allocate.
    Status allocate_items(vk::Context& context, const RasterDesc& desc);

    /// Replace the pair arrays by arrays for `capacity` pairs. The old ones are freed first, as
    /// both might not fit. On failure there are no pair arrays, and the capacity is 0.
    Status allocate_pairs(vk::Context& context, const RasterDesc& desc, std::uint32_t capacity);

    /// Size of all buffers.
    [[nodiscard]] std::uint64_t bytes() const { return item_bytes_ + pair_bytes_; }

    /// Most pairs for which each array fits one binding.
    static std::uint32_t max_capacity(const vk::DeviceInfo& device, const RasterDesc& desc);

    std::uint32_t capacity = 0;

    vk::Buffer splats, counts, radii, footprints, begins, slot_begins, large, cameras, background,
        active_tiles;
    vk::Buffer item_keys, item_order[2], item_count, sorted, sums, stats, pair_count, kept_pairs;
    vk::Buffer ranges, order, image, state, extra, normals, normal_image, exported, pose_partial,
        pose, intrinsics, contributions;
    RadixSortWorkspace item_sort;
    struct Pairs {
        vk::Buffer entries[2], slots[2];
        RadixSortWorkspace sort;
        vk::Buffer record_a, record_b, record_c, record_d;
    };
    Pairs pairs;

    [[nodiscard]] ItemViews items() const {
        return {.splats = splats.range(),
                .counts = counts.range(),
                .keys = item_keys.range(),
                .radii = radii.range(),
                .footprints = footprints.range(),
                .stats = stats.range()};
    }
    [[nodiscard]] RecordViews records() const {
        return {pairs.record_a.range(), pairs.record_b.range(), pairs.record_c.range(),
                slot_begins.range(), pairs.record_d.range()};
    }

  private:
    std::uint64_t item_bytes_ = 0;
    std::uint64_t pair_bytes_ = 0;
};

/// Tile rows of pass `pass` of `passes`.
Window pass_window(const RasterDesc& desc, std::uint32_t pass, std::uint32_t passes);

}  // namespace splat::raster

#pragma once

#include "raster/blend.h"
#include "raster/radix_sort.h"
#include "raster/tile_bin.h"
#include "vk/context.h"

namespace splat::raster {

/// A second part of a buffer begins at a multiple of so many bytes, which satisfies every alignment of bindings.
inline constexpr std::uint64_t kPartAlignment = 256;

/// Device memory of one Rasterizer. Item arrays have a fixed size, pair arrays grow.
class Workspace {
  public:
    /// Errors: those of Memory::allocate.
    Status allocate_items(vk::Context& context, const RasterDesc& desc);

    /// Replace the pair arrays by arrays for `capacity` pairs. The old ones are freed first, as
    /// both might not fit. On failure there are no pair arrays, and the capacity is 0.
    Status allocate_pairs(vk::Context& context, const RasterDesc& desc, std::uint32_t capacity);

    /// Size of all buffers but seen_stats, which is the host's.
    [[nodiscard]] std::uint64_t bytes() const { return item_bytes_ + pair_bytes_; }

    /// Most pairs for which each array fits one binding.
    static std::uint32_t max_capacity(const vk::Device& device, const RasterDesc& desc);

    std::uint32_t capacity = 0;

    vk::Buffer splats, counts, radii, footprints, begins, large, cameras, background, active_tiles,
        view_ranges;
    vk::Buffer item_keys, item_order[2], item_count, sorted, sums, stats, pair_count, kept_pairs;
    vk::Buffer ranges, order, image, state, extra, median, normals, normal_image, exported, pose,
        intrinsics, contributions;
    vk::Buffer
        seen_stats;  ///< what lists copy `stats` to for the host, where it does not see those; else empty
    RadixSortWorkspace item_sort;
    struct Pairs {
        vk::Buffer entries[2], slots[2];
        RadixSortWorkspace sort;
        std::vector<vk::Buffer> records;  ///< see RecordViews
    };
    Pairs pairs;

    [[nodiscard]] ItemViews items() const {
        return {.splats = splats.range(),
                .counts = counts.range().part(0, first_records_),
                .keys = item_keys.range(),
                .radii = radii.range(),
                .footprints = footprints.range(),
                .stats = stats.range()};
    }
    [[nodiscard]] vk::BufferView slot_begins() const {
        return counts.range().part(first_records_, counts.bytes() - first_records_);
    }
    [[nodiscard]] RecordViews records() const {
        RecordViews views{.sums = {}, .begins = slot_begins()};
        for (const vk::Buffer& buffer : pairs.records) views.sums.push_back(buffer.range());
        return views;
    }
    [[nodiscard]] ProjectionGradients projection() const {
        return {exported.range(), exported.range().part(poses_, exported.bytes() - poses_),
                pose.range(), intrinsics.range()};
    }

  private:
    std::uint64_t first_records_ = 0;  ///< bytes of `counts` before slot_begins
    std::uint64_t poses_ = 0;          ///< bytes of `exported` before sums of poses
    std::uint64_t item_bytes_ = 0;
    std::uint64_t pair_bytes_ = 0;
};

/// Tile rows of pass `pass` of `passes`.
Window pass_window(const RasterDesc& desc, std::uint32_t pass, std::uint32_t passes);

}  // namespace splat::raster

#pragma once

#include <array>
#include <span>
#include <vector>

#include "raster/raster_desc.h"
#include "scene/camera.h"

namespace splat::raster {

/// vec4 per view of the packed cameras: rows of [R|t]; fx fy cx cy; least and greatest x/z and y/z
/// of the Jacobian; position.
inline constexpr std::uint32_t kCameraQuads = 6;

/// Cameras, background, sizes of the views and active tiles of a call, as the kernels read them.
struct PackedViews {
    std::vector<float> cameras;  ///< [V,kCameraQuads] quads
    /// [1+V] quads: RGB; of each view width, height and, in two parts, its first Gaussian less the items before:
    /// multiples of 4096, and the rest
    std::vector<float> background;
    std::vector<std::uint32_t> active_tiles;  ///< [V,desc.mask_words()] one bit per tile, 1 if it
                                              ///< is drawn; empty: all are
    bool smaller = false;                     ///< a view is smaller than desc
    std::vector<std::uint32_t>
        view_ranges;          ///< [V,kRangeWords] of params/project_params.h, or empty
    RangePlan ranges;         ///< not used: each view sees all Gaussians
    std::uint64_t items = 0;  ///< sum of the ranges

    [[nodiscard]] std::uint32_t count() const {
        return static_cast<std::uint32_t>(cameras.size() / (std::size_t{4} * kCameraQuads));
    }
    bool operator==(const PackedViews&) const = default;
};

/// Pack the cameras of one call. A camera may have fewer columns or rows of pixels than desc: its
/// image is drawn as by a rasterizer of its size, and is 0 beyond. Errors: kInvalidArgument if there
/// are more than desc.views, or if a camera is singular, not finite, or larger than desc.
Result<PackedViews> pack_views(const RasterDesc& desc, std::span<const scene::Camera> cameras,
                               const std::array<float, 3>& background);

/// Leave tiles out of a call: where `active` [V,tiles_y,tiles_x] is 0, pixels are the background
/// with alpha 0, and pass no gradient. Errors: kInvalidArgument for another number of tiles.
Status mask_tiles(const RasterDesc& desc, std::span<const std::uint8_t> active, PackedViews& views);

/// Gaussians [first, first + count) of a set.
struct Range {
    std::uint32_t first = 0;
    std::uint32_t count = 0;

    bool operator==(const Range&) const = default;
};

/// Let each view of a call see a range of a set of `gaussians`. Its image, its items (ranges one after the other, see
/// ItemViews), gradients of its pose, intrinsics and items are those of a call for this view with these Gaussians
/// alone, to the bit. Gradients and contributions of the set are those of a call for each range, in the order of their
/// first views, whose results are added. Ids count from the set's first Gaussian.
///
/// Errors       kInvalidArgument for another number of ranges than views, a range beyond the set, more Gaussians in all
///              than desc.items()
Status see_ranges(const vk::DeviceInfo& device, const RasterDesc& desc, std::uint32_t gaussians,
                  std::span<const Range> ranges, PackedViews& views);

/// Errors: kInvalidArgument if a call for so many Gaussians and these views has more than desc.items().
Status check_items(const RasterDesc& desc, std::uint32_t gaussians, const PackedViews& views);

}  // namespace splat::raster

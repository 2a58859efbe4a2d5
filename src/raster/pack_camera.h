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
    std::vector<float> cameras;               ///< [V,kCameraQuads] quads
    std::vector<float> background;            ///< [1+V] quads: RGB; width and height of each view
    std::vector<std::uint32_t> active_tiles;  ///< [V,desc.mask_words()] one bit per tile, 1 if it
                                              ///< is drawn; empty: all are
    bool smaller = false;                     ///< a view is smaller than desc

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

}  // namespace splat::raster

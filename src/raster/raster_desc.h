#pragma once

#include <algorithm>
#include <cstdint>

#include "gaussians/gaussian_set.h"
#include "raster_constants.h"
#include "vk/device.h"

namespace splat::raster {

using gaussians::SetViews;
using gaussians::slice;

/// Rules that decide what a pixel sees. README.md compares them.
enum class Convention : int {
    k3dgs = 0,    ///< Kerbl et al. 2023: near plane 0.2, a square of 3 sigma in whole tiles
    kGsplat = 1,  ///< gsplat 1.6: near and far planes, exactly alpha >= 1/255, unit quaternions
    /// Yu et al. 2024, Gaussian Opacity Fields: opacity at the maximum along a pixel's ray, no dilation. Forward only.
    kRayMaximum = 2,
};

/// Work to skip. No skip changes the image; all are on by default.
struct Skips {
    bool opacity_extent = true;  ///< extents end where alpha falls below 1/255
    bool exact_tiles = true;     ///< tiles within the extent that the ellipse does not touch
    bool cull = true;       ///< do not sort Gaussians that reach no tile: between pixel centres,
                            ///< too faint or, antialiased, too small; what the convention culls
                            ///< is never sorted
    bool blocks = true;     ///< list entries that a block of pixels of a tile cannot see, in both
                            ///< passes; the plain kernels have no blocks
    bool early_out = true;  ///< blending ends when every pixel has stopped, in both passes; the
                            ///< plain kernels walk whole lists
    bool unchanged = true;  ///< forward does nothing if scene, cameras and background stay
};

/// Ranges of the Gaussians that the views of a call see, as far as command lists depend on them; see see_ranges().
struct RangePlan {
    bool used = false;
    std::uint32_t groups = 0;  ///< workgroups of the projection, of all views
    std::uint32_t layers = 0;  ///< ranges that overlap lie in different ones
    bool covers = false;       ///< ranges of the first layer hold all Gaussians
    std::uint32_t end = 0;     ///< Gaussians that the set has at least

    bool operator==(const RangePlan&) const = default;
};

/// Rows of tiles that one pass covers, in all views.
struct Window {
    std::uint32_t row_begin = 0;
    std::uint32_t row_end = 0;

    [[nodiscard]] std::uint32_t rows() const { return row_end - row_begin; }
    bool operator==(const Window&) const = default;
};

/// What to rasterize: a set and views of it. Fixed for the life of a Rasterizer, for which the numbers of Gaussians
/// and views, width and height are capacities.
struct RasterDesc : gaussians::SetDesc {
    std::uint32_t views = 1;
    std::uint32_t width = 0;  ///< pixels of the widest view, and the stride of images
    std::uint32_t height = 0;
    Convention convention = Convention::k3dgs;
    bool antialiased = false;       ///< opacity compensates for the dilation
    bool sort_by_distance = false;  ///< blended by the distance to the camera, not by depth
    bool cut_3_sigma = false;       ///< a Gaussian ends at 3 sigma, in its dilated ellipse
    float near_plane = kNear3dgs;
    float far_plane = kFarGsplat;
    bool extra = false;              ///< draw depth and contributors, too
    bool median = false;             ///< draw the median depth, too; it has no gradient
    bool normals = false;            ///< draw an image of normals, too
    bool backward = false;           ///< keep the data of the backward pass
    bool original_gradient = false;  ///< 3dgs: the original's gradient with its three quirks
    bool grad_depth = false;         ///< the loss depends on the accumulated depth
    bool grad_pose = false;          ///< gradient of the cameras
    bool grad_intrinsics = false;    ///< fx, fy, cx, cy have one, too; needs grad_pose
    bool export_gradients = false;   ///< gradients of the projected Gaussians, for densification
    bool contributions = false;  ///< backward sums each Gaussian's weights, and counts its pixels
    bool ids = false;            ///< draw the Gaussian of the largest weight, too; needs extra
    bool view_sizes = false;     ///< views are smaller; a Rasterizer sets it for each call
    bool tile_mask = false;      ///< tiles are off; a Rasterizer sets it for each call
    RangePlan ranges;            ///< what views see; a Rasterizer sets it for each call
    /// Most items (a Gaussian in a view) of a call, if fewer than all in all views. Of a call with ranges: their sum.
    std::uint64_t most_items = ~std::uint64_t{0};
    Skips skips;
    /// Rows of tiles that a call draws; none: all. A Rasterizer sets it for each call.
    Window rows;

    /// The rows that are drawn.
    [[nodiscard]] Window drawn_rows() const {
        return rows.rows() > 0 ? rows : Window{0, tiles_y()};
    }
    [[nodiscard]] std::uint64_t items() const {
        return std::min(std::uint64_t{gaussians} * views, most_items);
    }
    [[nodiscard]] std::uint64_t pixels() const { return std::uint64_t{width} * height * views; }
    [[nodiscard]] std::uint32_t tiles_x() const { return (width + 15) / 16; }
    [[nodiscard]] std::uint32_t tiles_y() const { return (height + 15) / 16; }
    [[nodiscard]] bool rays() const { return convention == Convention::kRayMaximum; }
    /// Quads of an item in the splats: with rays two more behind all (ray_form.glsl).
    [[nodiscard]] std::uint32_t splat_quads() const { return rays() ? 5 : 3; }
    /// Quads of a record of the backward pass, see RecordViews.
    [[nodiscard]] std::uint32_t record_quads() const { return contributions ? 4 : 3; }
    /// Words of 32 tiles in a view's mask.
    [[nodiscard]] std::uint64_t mask_words() const {
        return std::uint64_t{(tiles_x() + 31) / 32} * tiles_y();
    }
    [[nodiscard]] std::uint32_t flags() const;  ///< kFlag... of params/project_params.h
};

/// Most tiles of a window on CPU devices, all views together: one invocation may walk them all in the backward
/// pass. A tile takes up to three turns, and lavapipe ends loops after 65535.
inline constexpr std::uint64_t kMaxWindowTiles = 20000;

/// The same on any device: packed footprints have 16 bits for a tile's key (tile_footprint.glsl).
inline std::uint64_t max_window_tiles(const vk::DeviceInfo& device) {
    return device.kind == vk::DeviceKind::kCpu ? kMaxWindowTiles : 0xFFFE;
}

/// Most Gaussians per dispatch, so that no binding of a packed array exceeds the device's limit.
std::uint32_t slice_size(const vk::DeviceInfo& device, vk::Kernels kernels, const RasterDesc& desc);

}  // namespace splat::raster

#pragma once

#include "raster/pack_camera.h"
#include "vk/recorder.h"

namespace splat::raster {

/// Gaussians that a workgroup of the projection computes, each of one view.
std::uint32_t projection_group(const vk::DeviceInfo& device);

/// What the projection writes for each item (view * N + Gaussian; with ranges, those of the views one after the other).
struct ItemViews {
    vk::BufferView splats;      ///< [V*N,3] quads: see shaders/raster/project_forward.comp
    vk::BufferView counts;      ///< [V*N] uint32: tiles
    vk::BufferView keys;        ///< [V*N,2] uint32: bits of the depth, 0xFFFFFFFF if culled; item
    vk::BufferView radii;       ///< [V*N,2] float32: pixels; 0 if culled
    vk::BufferView footprints;  ///< [V*N,2] uint32: tiles, packed; see tile_footprint.glsl
    vk::BufferView stats;       ///< kStatWords uint32: adds to kStatNotFinite
};

/// What kernels read of a call's views: see PackedViews.
struct CallViews {
    vk::BufferView cameras;       ///< [V,kCameraQuads] quads
    vk::BufferView background;    ///< [1+V] quads: RGB; width and height of each view
    vk::BufferView active_tiles;  ///< [V,desc.mask_words()] uint32, unread unless desc.tile_mask
    vk::BufferView ranges;        ///< [V,kRangeWords] uint32, unread unless desc.ranges.used
};

/// Project and cull Gaussians, count their tiles in the window, and evaluate the colours of those
/// that a pixel may see. Only counts, keys and footprints depend on the window.
///
/// Errors       the recorder's
/// Precision    conics 4e-6 relative for needles of any ratio (tests/raster/needles_test.cpp)
/// Determinism  bit-exact for any thread count
/// Source       Kerbl et al. 2023 section 4; shaders/include/projection.glsl
Status project_forward(vk::Recorder& recorder, const RasterDesc& desc, const Window& window,
                       const SetViews& scene, const CallViews& call, const ItemViews& items);

/// Compute the normal of each Gaussian that reaches a tile, in camera coordinates, as [V*N] quads.
Status project_normals(vk::Recorder& recorder, const RasterDesc& desc, const SetViews& scene,
                       const CallViews& call, const ItemViews& items,
                       const vk::BufferView& normals);

/// Records of the blending's backward pass, one per pair: three quads and, with desc.contributions, a
/// fourth (sum of the weights, number of pixels, 0, 0).
struct RecordViews {
    /// [pairs,3 or 4] quads. Kernels for CPUs, where bindings are small, have four arrays instead:
    /// [pairs] quads each, the last [pairs] 2 float32 or unused.
    std::vector<vk::BufferView> sums;
    /// [V*N] uint32: an item's first record, slot_begins of tile_bin; behind ItemViews::counts in
    /// one buffer.
    vk::BufferView begins;

    [[nodiscard]] bool apart() const { return sums.size() > 1; }
};

/// Gradients with respect to the projected Gaussians and the cameras.
struct ProjectionGradients {
    vk::BufferView exported;      ///< [V*N,3] quads if desc.export_gradients; then pose_partial
    vk::BufferView pose_partial;  ///< pose_partial_bytes if desc.grad_pose; a part of exported
    vk::BufferView pose;          ///< [V,3] quads: rows of dL/d[R|t], or one quad
    vk::BufferView intrinsics;    ///< [V] quads: dL/d of fx, fy, cx, cy, if desc.grad_intrinsics
};

std::uint64_t pose_partial_bytes(const vk::DeviceInfo& device, const RasterDesc& desc);

/// Sum the records into gradients of the Gaussians, their colours and the cameras. With
/// `accumulate`, add them to the values already there. Gaussians that no view sees get 0.
///
/// Errors       the recorder's
/// Determinism  bit-exact for any thread count: records are summed in their order
/// Source       shaders/include/projection_backward.glsl; derived in tests/ref/project_ref.h
Status project_backward(vk::Recorder& recorder, const RasterDesc& desc, const SetViews& scene,
                        const CallViews& call, const ItemViews& items, const RecordViews& records,
                        const SetViews& gradients, const ProjectionGradients& projection,
                        bool accumulate);

/// Sum the weights of each Gaussian, and count the pixels that see it, over all views, from the
/// records: contributions [N,2] float32. With `accumulate`, add them to the values already there.
///
/// Determinism  bit-exact for any thread count: records are summed in their order
Status sum_contributions(vk::Recorder& recorder, const RasterDesc& desc, const CallViews& call,
                         const ItemViews& items, const RecordViews& records,
                         const vk::BufferView& contributions, bool accumulate);

/// Conics [items,3] from the splats [items,3] quads and the radii [items,2] of the projection: a,
/// b, c of exp(-(a x^2 + c y^2)/2 - b x y), or zeros where the item is culled.
std::vector<float> conics_of(std::span<const float> splats, std::span<const float> radii);

}  // namespace splat::raster

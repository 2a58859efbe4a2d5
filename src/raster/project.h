#pragma once

#include "raster/raster_desc.h"
#include "scene/gaussians.h"
#include "vk/recorder.h"

namespace splat::raster {

/// vec4 per view of the packed cameras: rows of [R|t]; fx fy cx cy; least and greatest x/z and y/z
/// of the Jacobian; position.
inline constexpr std::uint32_t kCameraQuads = 6;

/// What is rasterized, packed in vec4 and activated.
struct SceneViews {
    vk::BufferView gaussians;  ///< [N,3] quads: mean xyz, opacity; scale xyz, 0; rotation wxyz
    vk::BufferView colors;     ///< [N,color_quads] quads
    vk::BufferView cameras;    ///< [V,kCameraQuads] quads
    std::uint32_t sh_degree = scene::kMaxShDegree;  ///< bands above are zeros
};

/// Per item (view * N + Gaussian), written by the projection.
struct ItemViews {
    vk::BufferView splats;      ///< [V*N,3] quads: see shaders/raster/project_forward.comp
    vk::BufferView counts;      ///< [V*N] uint32: tiles
    vk::BufferView keys;        ///< [V*N,2] uint32: bits of the depth, 0xFFFFFFFF if culled; item
    vk::BufferView radii;       ///< [V*N,2] float32: pixels; 0 if culled
    vk::BufferView footprints;  ///< [V*N,2] uint32: tiles, packed; see tile_footprint.glsl
};

/// Project Gaussians into the views, cull them, count their tiles in the window, and evaluate the
/// colours of those dense enough to be seen. Only counts, keys and footprints depend on the window.
///
/// Errors       the recorder's
/// Precision    conics 4e-6 relative for needles of any ratio (tests/raster/needles_test.cpp)
/// Determinism  bit-exact for any thread count
/// Source       Kerbl et al. 2023 section 4; shaders/include/projection.glsl
Status project_forward(vk::Recorder& recorder, const RasterDesc& desc, const Window& window,
                       const SceneViews& scene, const ItemViews& items);

/// normals [V*N] quads: of each Gaussian that reaches a tile, in coordinates of the camera.
Status project_normals(vk::Recorder& recorder, const RasterDesc& desc, const SceneViews& scene,
                       const ItemViews& items, const vk::BufferView& normals);

/// Records of the blending backward pass, each [pairs] quads.
struct RecordViews {
    vk::BufferView a, b, c;
};

/// Where gradients go, packed like the scene.
struct GradientViews {
    vk::BufferView gaussians;     ///< like SceneViews::gaussians
    vk::BufferView colors;        ///< like SceneViews::colors
    vk::BufferView exported;      ///< [V*N,3] quads if desc.export_gradients, else one quad
    vk::BufferView pose_partial;  ///< pose_partial_bytes
    vk::BufferView pose;          ///< [V,3] quads: rows of dL/d[R|t], or one quad
};

std::uint64_t pose_partial_bytes(const vk::Recorder& recorder, const RasterDesc& desc);

/// Gradients by the Gaussians, their colours and the cameras, from the records; added to what is
/// there when `accumulate`.
///
/// begins       [V*N] uint32: first record of an item, slot_begins of tile_bin
/// Errors       the recorder's
/// Determinism  bit-exact for any thread count: records are summed in their order
/// Source       shaders/include/projection_backward.glsl; derived in tests/ref/project_ref.h
Status project_backward(vk::Recorder& recorder, const RasterDesc& desc, const SceneViews& scene,
                        const ItemViews& items, const vk::BufferView& begins,
                        const RecordViews& records, const GradientViews& gradients,
                        bool accumulate);

}  // namespace splat::raster

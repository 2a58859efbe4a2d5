#pragma once

#include "raster/project.h"
#include "vk/context.h"

namespace splat::raster {

struct BlendViews {
    vk::BufferView splats;   ///< output of project_forward
    vk::BufferView pairs;    ///< [pairs,2] uint32: tile and item, by tile, then depth
    vk::BufferView normals;  ///< [V*N] quads of project_normals; one quad if not desc.normals
    vk::BufferView slots;    ///< [pairs] uint32: the pair's record; backward only
    vk::BufferView ranges;   ///< [tiles] 2 uint32
    vk::BufferView order;  ///< [tiles] uint32 of tile_ranges; any quad if tile_order_used is false
    vk::BufferView background;  ///< [1+V] quads: RGB; width and height of each view
    vk::BufferView image;       ///< [V,H,W] quads: RGB over the background, alpha
    vk::BufferView state;       ///< [V,H,W] 2 float32: transmittance, entries before the stop
    vk::BufferView extra;       ///< [V,H,W] quads: accumulated and expected depth, contributors,
                                ///< with desc.ids the Gaussian of the largest weight (the first of
                                ///< equals) or -1, else 0; one quad if not desc.extra
    vk::BufferView median;  ///< [V,H,W] float32: median depth, or 0; one quad if not desc.median
};

/// The lists that a dispatch walks: all that have at most `entries` whole, or `entries` of each of the others, from
/// `begin` on. See walks() in blend.glsl.
struct ListPart {
    std::uint32_t entries = ~0U;
    bool of_long_lists = false;
    std::uint32_t begin = 0;
};

/// What is measured of the kernel of a pass.
vk::KernelPace& blend_pace(vk::Context& context, bool backward);

/// Entries of a part, by what is known of the kernel: a workgroup takes no longer than a submit may. A multiple of 256;
/// no result depends on it.
std::uint32_t part_entries(vk::Context& context, bool backward);

/// Blend each tile's list front to back into views.image. With `normals`, blend normals instead of
/// colours, without a background. Parts of long lists come in ascending order.
///
/// pairs_estimate  expected number of pairs, for the length of submits
/// Errors       the recorder's
/// Precision    1e-5 absolute, except on pixels where float32 rounding flips a decision
/// Determinism  bit-exact for any thread count
/// Source       Kerbl et al. 2023 section 6; shaders/raster/blend_forward.comp
Status blend_forward(vk::Recorder& recorder, const RasterDesc& desc, const Window& window,
                     const BlendViews& views, std::uint64_t pairs_estimate, bool normals = false,
                     const ListPart& part = {});

/// Gradient of blend_forward, written as one record per pair. Parts of long lists come in descending order.
///
/// grad_image   [V,H,W] quads: of RGB and alpha
/// grad_depth   [V,H,W] float32: of the accumulated depth; any quad if not desc.grad_depth
/// Determinism  bit-exact for any thread count; no atomics
Status blend_backward(vk::Recorder& recorder, const RasterDesc& desc, const Window& window,
                      const BlendViews& views, const vk::BufferView& grad_image,
                      const vk::BufferView& grad_depth, const RecordViews& records,
                      std::uint64_t pairs_estimate, const ListPart& part = {});

}  // namespace splat::raster

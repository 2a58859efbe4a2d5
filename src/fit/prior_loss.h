#pragma once

#include <optional>
#include <span>

#include "scene/camera.h"
#include "vk/recorder.h"

/// The losses that hold a drawn view to maps of depth and normals.
namespace splat::fit {

/// Inverse depth by a map p of relative inverse depth: scale p + shift, below 0 as 0.
struct PriorAlignment {
    double scale = 0, shift = 0;
    double mean = 1;  ///< mean inverse depth where it is known; above 0
};

/// One view.
struct PriorLossDesc {
    scene::Camera camera;    ///< a pinhole
    std::uint32_t view = 0;  ///< which of the images
    double depth_weight = 0, normal_weight = 0;
    /// Nothing: least squares to the inverse depth that is drawn, in each call.
    std::optional<PriorAlignment> alignment;
};

/// Pixels of a map that have a depth, and a normal.
struct PriorCounts {
    std::uint32_t depth = 0, normal = 0;
};

struct PriorLossViews {
    vk::BufferView image;       ///< [V,H,W] quads, as the rasterizer draws them: alpha A
    vk::BufferView extra;       ///< [V,H,W] quads: accumulated depth D
    vk::BufferView map;         ///< [H,W] pairs of uint32, see packed_maps()
    vk::BufferView workspace;   ///< prior_loss_workspace
    vk::BufferView grad_depth;  ///< [V,H,W], that of the view is overwritten
    vk::BufferView grad_image;  ///< [V,H,W] quads, alpha's gradient of the view is added to
    vk::BufferView partial;     ///< prior_loss_partial, overwritten: read it with prior_loss_sums
};

/// Means over the pixels that count.
struct PriorLosses {
    double depth = 0;
    double normal = 0;
};

/// Bytes of the workspace and of the partial sums.
std::uint64_t prior_loss_workspace(const vk::Recorder& recorder, const PriorLossDesc& desc);
std::uint64_t prior_loss_partial(const PriorLossDesc& desc);

/// Losses of a view and their gradient. With y = A / D, y0 the aligned map and n the normal by central differences of
/// the places D / A ((x - cx) / fx, (y - cy) / fy, 1), which faces the camera, where A > 1/2, and n0 that of the map,
///
///   loss = depth_weight mean |y - y0| / mean y0 + normal_weight mean (1 - n n0)
///
/// Means are over all pixels that have a depth or a normal in the map; those that are not drawn add 0. The alignment
/// counts as constant. A map that the drawn depth contradicts, whose scale would not be positive, has no loss.
///
/// share        factor of the gradient, such as 1 / views of a step
/// Errors       kInvalidArgument (a size of 0), kShape (a view that is too small), the recorder's
/// Precision    gradient 1e-4 of its largest values
/// Determinism  bit-exact for any thread count
/// Source       Kerbl et al. 2024, doi:10.1145/3658160 (depth); Huang et al. 2024, doi:10.1145/3641519.3657428
///              (normals); Ranftl et al. 2022, doi:10.1109/TPAMI.2020.3019967 (alignment by least squares)
Status prior_loss(vk::Recorder& recorder, const PriorLossDesc& desc, const PriorLossViews& views,
                  const PriorCounts& counts, double share);

/// What prior_loss left in `partial`, downloaded; the sum has a fixed order.
PriorLosses prior_loss_sums(std::span<const float> partial, const PriorCounts& counts);

}  // namespace splat::fit

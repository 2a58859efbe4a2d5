#pragma once

#include <cstdint>
#include <vector>

#include "raster/raster_case.h"
#include "ref/rasterize_ref.h"
#include "ref/tile_bin_ref.h"

/// Results of a rasterizer, in one form for golden files, the reference and kernels. An empty field
/// is not compared.
namespace splat::test {

struct RasterOutputs {
    std::vector<double> rgb;             ///< [H,W,3] background composited
    std::vector<double> alpha;           ///< [H,W]
    std::vector<double> depth;           ///< [H,W] accumulated
    std::vector<double> depth_expected;  ///< [H,W]
    std::vector<double> median;          ///< [H,W] median depth
    std::vector<double>
        median_early;            ///< [H,W] of a reference: another one that rounding may make of it
    std::vector<double> normal;  ///< [H,W,3] accumulated
    std::vector<std::int64_t> n_contrib;

    std::vector<double> means2d;           ///< [n,2] pixels, centres at + 0.5 in both conventions
    std::vector<double> conics;            ///< [n,3]
    std::vector<double> depths;            ///< [n]
    std::vector<double> colors;            ///< [n,3]
    std::vector<double> compensations;     ///< [n]
    std::vector<std::int64_t> radii;       ///< [n,2]; 0 = culled
    std::vector<std::int64_t> valid;       ///< [n] 0 or 1
    std::vector<std::int64_t> order;       ///< indices of valid ones, as blended
    std::vector<std::int64_t> tiles_rect;  ///< [n]
    std::vector<std::int64_t> tiles_exact;
    std::vector<std::int64_t> pixels_visible;
};

struct RasterGradients {
    std::vector<double> means;            ///< [n,3]
    std::vector<double> scales;           ///< [n,3]
    std::vector<double> rotations;        ///< [n,4]
    std::vector<double> opacities;        ///< [n]
    std::vector<double> sh;               ///< [n,sh_coefficients,3]
    std::vector<double> colors;           ///< [n,3]
    std::vector<double> means2d;          ///< [n,2] per pixel, not Inria's per half image
    std::vector<double> means2d_abs;      ///< [n,2]
    std::vector<double> conics;           ///< [n,3]
    std::vector<double> world_to_camera;  ///< [4,4] all entries free
    std::vector<double> twist;            ///< [6] translation, rotation
    std::vector<double> intrinsics;       ///< [4] fx, fy, cx, cy
};

/// All outputs of the reference for a scene. `counts` adds those of tile_bin(), which take as long
/// as the image.
template <class Real>
RasterOutputs reference_outputs(const ref::RasterScene<Real>& scene, bool counts = false) {
    const ref::ProjectForward<Real> projected = ref::project_forward(scene);
    const ref::BlendForward<Real> blended = ref::blend_forward(scene, projected);
    const auto widened = [](const std::vector<Real>& values) {
        return std::vector<double>(values.begin(), values.end());
    };
    RasterOutputs out;
    out.rgb = widened(blended.rgb);
    out.alpha = widened(blended.alpha);
    out.depth = widened(blended.depth);
    out.depth_expected = widened(blended.depth_expected);
    out.median = widened(blended.median);
    out.median_early = widened(blended.median_early);
    out.normal = widened(blended.normal);
    out.n_contrib = blended.n_contrib;
    for (const ref::ProjectedGaussian<Real>& g : projected.gaussians) {
        out.means2d.insert(out.means2d.end(), g.mean2d.begin(), g.mean2d.end());
        out.conics.insert(out.conics.end(), g.conic.begin(), g.conic.end());
        out.colors.insert(out.colors.end(), g.color.begin(), g.color.end());
        out.radii.insert(out.radii.end(), g.radius.begin(), g.radius.end());
        out.depths.push_back(static_cast<double>(g.depth));
        out.compensations.push_back(static_cast<double>(g.compensation));
        out.valid.push_back(g.valid ? 1 : 0);
    }
    out.order.assign(projected.order.begin(), projected.order.end());
    if (counts) {
        const ref::TileBin bin = ref::tile_bin(scene, projected);
        out.tiles_rect = bin.tiles_rect;
        out.tiles_exact = bin.tiles_exact;
        out.pixels_visible = bin.pixels_visible;
    }
    return out;
}

template <class Real>
RasterGradients reference_gradients(const ref::RasterScene<Real>& scene,
                                    const ref::RasterLoss<Real>& loss) {
    const ref::RasterBackward<Real> from = ref::rasterize_backward(scene, loss);
    const auto widened = [](const auto& values) {
        return std::vector<double>(values.begin(), values.end());
    };
    RasterGradients out;
    out.means = widened(from.grad_means);
    out.scales = widened(from.grad_scales);
    out.rotations = widened(from.grad_rotations);
    out.opacities = widened(from.grad_opacities);
    out.sh = widened(from.grad_sh);
    out.colors = widened(from.grad_colors);
    out.means2d = widened(from.grad_means2d);
    out.means2d_abs = widened(from.grad_means2d_abs);
    out.conics = widened(from.grad_conics);
    out.world_to_camera = widened(from.grad_world_to_camera);
    out.twist = widened(from.grad_twist);
    out.intrinsics = widened(from.grad_intrinsics);
    return out;
}

}  // namespace splat::test

#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "ref/blend_ref.h"

/// Gradient of blend_forward for the loss
///
///   L = sum grad_rgb rgb + grad_alpha alpha + grad_depth depth.
///
/// Back to front in a pixel, with S the part of L that Gaussians behind i and the background
/// contribute per unit of transmittance left by i, times that transmittance:
///
///   q_i = grad_rgb . color_i + grad_depth z_i      S_i = sum_{j>i} w_j q_j
///   dL/dalpha_i = T_i q_i - S_i / (1 - alpha_i) + T_end (grad_alpha - background . grad_rgb) /
///                 (1 - alpha_i)
///
/// because T_j of everything behind i, and T_end, have the factor 1 - alpha_i. Then, where alpha is
/// not clamped, with the density d = opacity exp(-sigma)
///
///   dL/dopacity = exp(-sigma) dL/dalpha      dL/dsigma = -d dL/dalpha
///   dL/dconic = dL/dsigma (dx^2 / 2, dx dy, dy^2 / 2)
///   dL/dmean2d = dL/dsigma (conic0 dx + conic1 dy, conic1 dx + conic2 dy)
namespace splat::ref {

/// Weights of the loss; empty for none.
template <class Real>
struct RasterLoss {
    std::vector<Real> grad_rgb;    ///< [H,W,3]
    std::vector<Real> grad_alpha;  ///< [H,W]
    std::vector<Real> grad_depth;  ///< [H,W] of the accumulated depth
};

template <class Real>
struct BlendBackward {
    std::vector<Real> grad_means2d;      ///< [n,2] per pixel of image space
    std::vector<Real> grad_means2d_abs;  ///< [n,2] sum over pixels of the absolute value
    std::vector<Real> grad_conics;       ///< [n,3]
    std::vector<Real> grad_colors;       ///< [n,3]
    std::vector<Real> grad_opacities;    ///< [n] of the opacity with compensation
    std::vector<Real> grad_depths;       ///< [n]

    explicit BlendBackward(std::size_t n)
        : grad_means2d(2 * n),
          grad_means2d_abs(2 * n),
          grad_conics(3 * n),
          grad_colors(3 * n),
          grad_opacities(n),
          grad_depths(n) {}
};

/// Loss weights of one pixel.
template <class Real>
struct PixelLoss {
    Vec3<Real> rgb{};
    Real alpha = 0;
    Real depth = 0;

    PixelLoss(const RasterLoss<Real>& loss, std::size_t pixel) {
        if (!loss.grad_rgb.empty()) rgb = row3(loss.grad_rgb, pixel);
        if (!loss.grad_alpha.empty()) alpha = loss.grad_alpha[pixel];
        if (!loss.grad_depth.empty()) depth = loss.grad_depth[pixel];
    }

    [[nodiscard]] bool is_zero() const {
        return dot(rgb, rgb) == Real(0) && alpha == Real(0) && depth == Real(0);
    }
};

/// From dL/dalpha of one hit to its Gaussian.
template <class Real>
void density_backward(const RasterScene<Real>& scene, const ProjectedGaussian<Real>& g,
                      const Blended<Real>& hit, Real grad_alpha, BlendBackward<Real>& out) {
    const bool clamped = hit.density > static_cast<Real>(raster::kAlphaMax);
    if (clamped && !scene.options.is_original()) return;
    const std::size_t i = hit.index;
    const Real grad_sigma = -hit.density * grad_alpha;
    const auto [A, B, C] = g.conic;
    const std::array<Real, 2> grad_mean2d{grad_sigma * (A * hit.dx + B * hit.dy),
                                          grad_sigma * (B * hit.dx + C * hit.dy)};
    out.grad_opacities[i] += hit.density / g.opacity * grad_alpha;
    for (std::size_t k = 0; k < 2; ++k) {
        out.grad_means2d[2 * i + k] += grad_mean2d[k];
        out.grad_means2d_abs[2 * i + k] += std::abs(grad_mean2d[k]);
    }
    out.grad_conics[3 * i] += grad_sigma * hit.dx * hit.dx / Real(2);
    out.grad_conics[3 * i + 1] += grad_sigma * hit.dx * hit.dy;
    out.grad_conics[3 * i + 2] += grad_sigma * hit.dy * hit.dy / Real(2);
}

template <class Real>
BlendBackward<Real> blend_backward(const RasterScene<Real>& scene,
                                   const ProjectForward<Real>& projected,
                                   const RasterLoss<Real>& loss) {
    BlendBackward<Real> out(scene.count());
    for (std::size_t p = 0; p < scene.pixels(); ++p) {
        const std::size_t width = scene.camera.width;
        const PixelLoss<Real> grad(loss, p);
        if (grad.is_zero()) continue;
        const BlendedPixel<Real> pixel = blend_pixel(scene, projected, p % width, p / width);
        const Real grad_end = grad.alpha - dot(grad.rgb, scene.background);
        Real behind = -pixel.transmittance * grad_end;  // S_i - T_end (...)
        for (std::size_t h = pixel.hits.size(); h-- > 0;) {
            const Blended<Real>& hit = pixel.hits[h];
            const ProjectedGaussian<Real>& g = projected.gaussians[hit.index];
            const Real weight = hit.alpha * hit.transmittance;
            const Real value = dot(grad.rgb, g.color) + grad.depth * g.depth;
            for (std::size_t k = 0; k < 3; ++k)
                out.grad_colors[3 * hit.index + k] += weight * grad.rgb[k];
            out.grad_depths[hit.index] += weight * grad.depth;
            const Real grad_alpha = hit.transmittance * value - behind / (Real(1) - hit.alpha);
            density_backward(scene, g, hit, grad_alpha, out);
            behind += weight * value;
        }
    }
    return out;
}

}  // namespace splat::ref

#include "raster/fragile.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace splat::test {
namespace {

using Gaussian = ref::ProjectedGaussian<double>;

constexpr double kRounding = kFragileUlps * 0x1p-24;
/// Ulps of positions and depths, which are short sums.
constexpr double kMeanRounding = 16 * 0x1p-24;

/// A density and its expected relative error.
struct Density {
    double value = 0;
    double error = 0;
    double sigma = 0;
    bool at_near = false;  ///< ray_maximum: its depth may be on either side of the near plane
};

/// By how much numbers of a mean and of axes that are off by kMeanRounding change sigma and depth.
Density ray_density(const Gaussian& g, std::size_t column, std::size_t row) {
    const ref::RayMaximum<double> seen = ref::ray_maximum(g, column, row);
    double sigma_error = 0;
    double depth_error = 0;
    const auto move = [&](Gaussian moved) {
        const ref::RayMaximum<double> found = ref::ray_maximum(moved, column, row);
        sigma_error += std::abs(found.squared - seen.squared) / 2;
        depth_error += std::abs(found.depth - seen.depth);
    };
    for (std::size_t k = 0; k < 3; ++k) {
        Gaussian moved = g;
        moved.camera_mean[k] *= 1 + kMeanRounding;
        move(moved);
        const auto& axis = g.ray.whitening[k];
        const double length = std::sqrt(ref::dot(axis, axis));
        for (std::size_t c = 0; c < 3; ++c) {
            moved = g;
            moved.ray.whitening[k][c] += kMeanRounding * length;
            move(moved);
        }
    }
    const double sigma = seen.squared / 2;
    const double density = g.opacity * std::exp(-sigma);
    const bool at_near = std::abs(seen.depth - g.ray.near_plane) <= depth_error;
    const bool before = seen.depth <= g.ray.near_plane && !at_near;
    return {before ? 0 : density, kRounding * (1 + sigma) + sigma_error, sigma, at_near};
}

Density density_of(const ref::RasterScene<double>& scene, const Gaussian& g, std::size_t column,
                   std::size_t row) {
    if (g.ray.used) return ray_density(g, column, row);
    const auto width = static_cast<double>(scene.camera.width);
    const auto height = static_cast<double>(scene.camera.height);
    const double dx = g.mean2d[0] - (static_cast<double>(column) + 0.5);
    const double dy = g.mean2d[1] - (static_cast<double>(row) + 0.5);
    const auto [A, B, C] = g.conic;
    const double squares = (A * dx * dx + C * dy * dy) / 2;
    const double mixed = B * dx * dy;
    const double moved = std::abs(A * dx + B * dy) * (std::abs(g.mean2d[0]) + width) +
                         std::abs(B * dx + C * dy) * (std::abs(g.mean2d[1]) + height);
    return {g.opacity * std::exp(-squares - mixed),
            kRounding * (1 + squares + std::abs(mixed)) + kMeanRounding * moved, squares + mixed,
            false};
}

constexpr double kAlphaMin = raster::kAlphaMin;
constexpr double kAlphaMax = raster::kAlphaMax;
constexpr double kCutSigma = 4.5;
constexpr double kTransmittanceMin = raster::kTransmittanceMin;

bool is_next_to(double value, double border, double relative) {
    return std::abs(value - border) <= relative * border;
}

/// Boxes of 3dgs, rounded to be smaller and to be larger.
struct Boxes {
    Gaussian inner;
    Gaussian outer;
};

Boxes boxes_of(const ref::RasterScene<double>& scene, const Gaussian& g) {
    Boxes boxes{g, g};
    for (const double move : {-1.0, 1.0})
        for (const double grow : {-1.0, 1.0}) {
            Gaussian moved = g;
            for (std::size_t axis = 0; axis < 2; ++axis)
                moved.mean2d[axis] += move * kRounding * (std::abs(g.mean2d[axis]) + 1);
            for (double& element : moved.cov) element *= 1 + grow * kRounding;
            ref::project_box(scene, moved);
            for (const std::size_t first : {0U, 1U}) {
                const std::size_t end = first + 2;
                boxes.inner.tiles[first] = std::max(boxes.inner.tiles[first], moved.tiles[first]);
                boxes.inner.tiles[end] = std::min(boxes.inner.tiles[end], moved.tiles[end]);
                boxes.outer.tiles[first] = std::min(boxes.outer.tiles[first], moved.tiles[first]);
                boxes.outer.tiles[end] = std::max(boxes.outer.tiles[end], moved.tiles[end]);
            }
        }
    return boxes;
}

class FragileSearch {
  public:
    explicit FragileSearch(const ref::RasterScene<double>& scene)
        : scene_(scene), projected_(ref::project_forward(scene)) {
        if (!scene.options.is_3dgs()) return;
        for (const Gaussian& g : projected_.gaussians) boxes_.push_back(boxes_of(scene, g));
    }

    [[nodiscard]] bool at(std::size_t column, std::size_t row) const {
        double transmittance = 1;
        double error = kRounding;  // relative, of the transmittance
        double key_before = 0;
        for (const std::uint32_t i : projected_.order) {
            const Gaussian& g = projected_.gaussians[i];
            const Density density = density_of(scene_, g, column, row);
            const bool outer = boxes_.empty() || covers(boxes_[i].outer, column, row);
            const bool inner = boxes_.empty() || covers(boxes_[i].inner, column, row);
            if (!outer || density.value < kAlphaMin * (1 - density.error)) continue;
            const double beyond = scene_.options.cut_3_sigma ? density.sigma - kCutSigma : -1;
            if (beyond > density.error) continue;
            const double key = ref::order_key(scene_, g);
            const double gap = key - key_before;
            const double key_rounding =
                kMeanRounding * (std::abs(key) + std::abs(scene_.camera.world_to_camera[11]));
            if (!inner || density.at_near || beyond >= -density.error ||
                is_next_to(density.value, kAlphaMin, density.error) ||
                is_next_to(density.value, kAlphaMax, density.error) ||
                (gap > 0 && gap <= key_rounding))
                return true;
            key_before = key;
            const bool clamped = density.value > kAlphaMax;
            const double alpha = clamped ? kAlphaMax : density.value;
            error += clamped ? 0x1p-22 : density.error * alpha / (1 - alpha);
            transmittance *= 1 - alpha;
            if (is_next_to(transmittance, kTransmittanceMin, error)) return true;
            if (transmittance < kTransmittanceMin) return false;
        }
        return false;
    }

  private:
    [[nodiscard]] bool covers(const Gaussian& g, std::size_t column, std::size_t row) const {
        return ref::reaches(scene_, g, column, row);
    }

    const ref::RasterScene<double>& scene_;
    ref::ProjectForward<double> projected_;
    std::vector<Boxes> boxes_;
};

}  // namespace

std::vector<bool> fragile_pixels(const ref::RasterScene<double>& scene,
                                 const std::vector<std::size_t>& pixels) {
    const FragileSearch search(scene);
    std::vector<bool> fragile;
    for (const std::size_t pixel : pixels)
        fragile.push_back(search.at(pixel % scene.camera.width, pixel / scene.camera.width));
    return fragile;
}

std::vector<bool> fragile_pixels(const ref::RasterScene<double>& scene) {
    std::vector<std::size_t> all(scene.camera.width * scene.camera.height);
    std::iota(all.begin(), all.end(), std::size_t{0});
    return fragile_pixels(scene, all);
}

}  // namespace splat::test

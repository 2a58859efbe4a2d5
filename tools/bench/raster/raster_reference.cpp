#include "bench/raster/raster_reference.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "ref/images/srgb_ref.h"
#include "ref/rasterize_ref.h"
#include "vkrun/cli/handles.h"

namespace vkrun::bench {
namespace {

namespace ref = splat::ref;

std::vector<double> attribute(const RasterCase& from, const char* name, std::size_t elements) {
    std::vector<float> values(elements);
    if (elements > 0)
        check(splat_scene_read(from.scene.get(), name, values.data(), elements * sizeof(float)));
    return {values.begin(), values.end()};
}

ref::RasterScene<double> reference_scene(const RasterCase& from, std::size_t view) {
    auto info = sized<splat_scene_info>();
    check(splat_scene_get_info(from.scene.get(), &info));
    const std::size_t n = info.count;
    ref::RasterScene<double> scene;
    scene.sh_coefficients = std::size_t{info.sh_degree + 1} * (info.sh_degree + 1);
    scene.means = attribute(from, "means", 3 * n);
    scene.scales = attribute(from, "scales", 3 * n);
    scene.rotations = attribute(from, "rotations", 4 * n);
    scene.opacities = attribute(from, "opacities", n);
    scene.sh = attribute(from, "sh", 3 * scene.sh_coefficients * n);
    for (std::size_t k = 0; k < 3; ++k)
        scene.background[k] = static_cast<double>(from.background[k]);
    const splat_camera& camera = from.cameras[view];
    scene.camera = {camera.fx, camera.fy, camera.cx, camera.cy, camera.width, camera.height, {}};
    std::copy_n(camera.world_to_camera, 16, scene.camera.world_to_camera.begin());
    scene.options = ref::raster_options<double>(from.convention == SPLAT_CONVENTION_GSPLAT
                                                    ? ref::Convention::kGsplat
                                                    : ref::Convention::k3dgs);
    scene.options.antialiased = (info.drawn_as & SPLAT_DRAWN_ANTIALIASED) != 0;
    scene.options.sort_by_distance = (info.drawn_as & SPLAT_DRAWN_BY_DISTANCE) != 0;
    scene.options.cut_3_sigma = (info.drawn_as & SPLAT_DRAWN_CUT_3_SIGMA) != 0;
    if ((info.drawn_as & SPLAT_DRAWN_LINEAR_COLORS) != 0)
        for (double& channel : scene.background) channel = ref::linear_of_srgb(channel);
    return scene;
}

bool sees(const ref::RasterScene<double>& scene, const ref::ProjectedGaussian<double>& g,
          std::size_t tile_x, std::size_t tile_y) {
    constexpr std::size_t kSide = splat::raster::kTileSize;
    const std::size_t right = std::min((tile_x + 1) * kSide, std::size_t{scene.camera.width});
    const std::size_t bottom = std::min((tile_y + 1) * kSide, std::size_t{scene.camera.height});
    for (std::size_t row = tile_y * kSide; row < bottom; ++row)
        for (std::size_t column = tile_x * kSide; column < right; ++column)
            if (ref::density_at(g, column, row).alpha >=
                static_cast<double>(splat::raster::kAlphaMin))
                return true;
    return false;
}

double largest_of(const std::vector<double>& values) {
    double largest = 0;
    for (const double value : values) largest = std::max(largest, std::abs(value));
    return largest;
}

/// Infinite if `got` is NaN, which std::max would ignore.
double off_by(float got, double expected) {
    const double off = std::abs(static_cast<double>(got) - expected);
    return std::isfinite(off) ? off : std::numeric_limits<double>::infinity();
}

/// Pairs of one view.
std::uint64_t pairs_seen(const ref::RasterScene<double>& scene) {
    const ref::ProjectForward<double> projected = ref::project_forward(scene);
    std::uint64_t pairs = 0;
    for (const std::uint32_t i : projected.order) {
        const ref::ProjectedGaussian<double>& g = projected.gaussians[i];
        for (std::size_t y = g.tiles[1]; y < g.tiles[3]; ++y)
            for (std::size_t x = g.tiles[0]; x < g.tiles[2]; ++x)
                pairs += sees(scene, g, x, y) ? 1 : 0;
    }
    return pairs;
}

}  // namespace

std::uint64_t fewest_pairs(const RasterCase& from) {
    std::uint64_t pairs = 0;
    for (std::size_t view = 0; view < from.cameras.size(); ++view)
        pairs += pairs_seen(reference_scene(from, view));
    return pairs;
}

RasterReference::RasterReference(const RasterCase& from, int samples) {
    const ref::RasterScene<double> scene = reference_scene(from, 0);
    const ref::ProjectForward<double> projected = ref::project_forward(scene);
    std::mt19937 random(1);
    std::uniform_int_distribution<std::size_t> any_pixel(0, scene.pixels() - 1);
    std::uniform_real_distribution<float> weight(-1, 1);
    grad_rgb_.assign(3 * scene.pixels(), 0.0F);
    for (int i = 0; i < samples; ++i) {
        const std::size_t pixel = any_pixel(random);
        pixels_.push_back(pixel);
        const auto blended = ref::blend_pixel(scene, projected, pixel % scene.camera.width,
                                              pixel / scene.camera.width);
        std::array<double, 3> rgb{};
        for (std::size_t k = 0; k < 3; ++k) {
            rgb[k] = blended.transmittance * scene.background[k];
            for (const auto& hit : blended.hits)
                rgb[k] += hit.alpha * hit.transmittance * projected.gaussians[hit.index].color[k];
            grad_rgb_[3 * pixel + k] = weight(random);
        }
        rgb_.insert(rgb_.end(), rgb.begin(), rgb.end());
    }
    ref::RasterLoss<double> loss;
    loss.grad_rgb.assign(grad_rgb_.begin(), grad_rgb_.end());
    const auto gradients =
        ref::project_backward(scene, projected, ref::blend_backward(scene, projected, loss));
    gradients_ = {{"means", gradients.grad_means},
                  {"scales", gradients.grad_scales},
                  {"rotations", gradients.grad_rotations},
                  {"opacities", gradients.grad_opacities},
                  {"sh", gradients.grad_sh}};
}

RasterError RasterReference::compare(
    const std::vector<float>& rgb,
    const std::map<std::string, std::vector<float>>& gradients) const {
    RasterError error;
    std::vector<double> differences;
    for (std::size_t i = 0; i < pixels_.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k)
            differences.push_back(off_by(rgb[3 * pixels_[i] + k], rgb_[3 * i + k]));
    std::sort(differences.begin(), differences.end());
    if (!differences.empty()) {
        error.max_rgb = differences.back();
        error.typical_rgb = differences[differences.size() * 95 / 100];
    }
    double largest_of_all = 0;
    for (const auto& [name, values] : gradients_)
        largest_of_all = std::max(largest_of_all, largest_of(values));
    for (const auto& [name, got] : gradients) {
        const std::vector<double>& expected = gradients_.at(name);
        const double largest = largest_of(expected);
        // A gradient that is zero up to rounding in float64, such as that of the rotation of isotropic
        // Gaussians, cannot be the unit of errors.
        const bool zero = largest <= 1e-9 * largest_of_all;
        double off = 0;
        for (std::size_t i = 0; i < expected.size(); ++i)
            off = std::max(off, off_by(got[i], expected[i]));
        if (largest_of_all > 0)
            error.max_gradient =
                std::max(error.max_gradient, off / (zero ? largest_of_all : largest));
    }
    return error;
}

}  // namespace vkrun::bench

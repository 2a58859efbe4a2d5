#include "stress/raster_bound.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "ref/rounded.h"

namespace vkrun::stress {
namespace {

namespace ref = splat::ref;

/// Roundings of a product and of a sum of three more.
constexpr double kSums = 4;
/// The Cholesky factor of a conic has these: sqrt(c) / sqrt(det), of rows divided by the depth.
constexpr double kFactor = kSums + 2 * ref::kQuotientRoundings + 2 * ref::kRootRoundings;
constexpr double kUnitVector = kSums + ref::kInverseRootRoundings;
// shaders/include/raster/ray_form.glsl has the same.
constexpr double kRayMargin = 1e-3, kRayMeanMargin = 4e-6;

/// Moves numbers by up to so many roundings.
class Noise {
  public:
    explicit Noise(unsigned seed) : random_(seed) {}
    void move(double& number, double roundings = kSums) {
        number *= 1 + roundings * kRounding * unit_(random_);
    }
    template <class Numbers>
    void move_all(Numbers& numbers, double roundings = kSums) {
        for (double& number : numbers) move(number, roundings);
    }

  private:
    std::mt19937 random_;
    std::uniform_real_distribution<double> unit_{-1, 1};
};

void move_inputs(Noise& noise, RasterScene& scene) {
    for (std::vector<double>* values :
         {&scene.means, &scene.scales, &scene.rotations, &scene.opacities, &scene.sh})
        noise.move_all(*values);
    noise.move_all(scene.background);
    for (double* number : {&scene.camera.fx, &scene.camera.fy, &scene.camera.cx, &scene.camera.cy})
        noise.move(*number);
    for (std::size_t i = 0; i < 12; ++i) noise.move(scene.camera.world_to_camera[i]);
}

/// Moves the factor L of the conic L L^T, which kernels blend with: in needles the conic's own numbers cancel.
void move_conic(Noise& noise, ref::ProjectedGaussian<double>& g) {
    const double root_c = std::sqrt(g.cov[2]), root_det = std::sqrt(g.det);
    std::array<double, 3> l{root_c / root_det, -g.cov[1] / (root_c * root_det), 1 / root_c};
    noise.move_all(l, kFactor);
    g.conic = {l[0] * l[0], l[0] * l[1], l[1] * l[1] + l[2] * l[2]};
}

/// Moves what the form along rays follows from: the mean, and axes divided by scales.
void move_rays(Noise& noise, ref::ProjectedGaussian<double>& g) {
    noise.move_all(g.camera_mean, kSums + ref::kQuotientRoundings);
    for (ref::Vec3<double>& axis : g.ray.whitening) {
        const double length = std::sqrt(ref::dot(axis, axis));
        for (double& number : axis) {
            double moved = length;
            noise.move(moved, kFactor + kUnitVector);
            number += moved - length;
        }
    }
}

/// exp2(-p) is 6 + 4 p roundings off: at most 6 of the opacity. Harmonics have degree 3 in a unit vector.
void move_projected(Noise& noise, const RasterScene& scene,
                    ref::ProjectForward<double>& projected) {
    const double by_pixel = kSums + ref::exp_roundings(0);
    const double root = ref::kQuotientRoundings + ref::kRootRoundings;
    for (const std::uint32_t i : projected.order) {
        ref::ProjectedGaussian<double>& g = projected.gaussians[i];
        noise.move_all(g.mean2d, kSums + ref::kQuotientRoundings);
        if (g.ray.used)
            move_rays(noise, g);
        else
            move_conic(noise, g);
        noise.move_all(g.color, kSums + (scene.sh_coefficients > 1 ? 3 * kUnitVector : 0));
        noise.move_all(g.normal, 2 * kUnitVector);
        noise.move(g.opacity, by_pixel + (scene.options.antialiased ? root : 0));
        noise.move(g.depth);
    }
}

template <class Real>
RasterResults<Real> results_of(const ref::RasterScene<Real>& scene,
                               const ref::ProjectForward<Real>& projected,
                               const ref::ProjectForward<Real>& before,
                               const ref::RasterLoss<Real>& loss) {
    RasterResults<Real> results;
    const ref::BlendForward<Real> images = ref::blend_forward(scene, projected);
    results["rgb"] = images.rgb;
    results["alpha"] = images.alpha;
    results["depth"] = images.depth;
    results["normal"] = images.normal;
    for (const auto& g : projected.gaussians) {
        const auto push = [&](const char* name, Real value) {
            results[name].push_back(g.valid ? value : Real(0));
        };
        for (const Real value : g.mean2d) push("means2d", value);
        if (!scene.options.is_ray())
            for (const Real value : g.conic) push("conics", value);
        push("depths", g.depth);
    }
    if (scene.options.is_ray()) return results;
    const ref::RasterBackward<Real> back =
        ref::project_backward(scene, before, ref::blend_backward(scene, projected, loss));
    results["grad_means"] = back.grad_means;
    results["grad_scales"] = back.grad_scales;
    results["grad_rotations"] = back.grad_rotations;
    results["grad_opacities"] = back.grad_opacities;
    results["grad_sh"] = back.grad_sh;
    return results;
}

RasterResults<double> moved_results(const RasterScene& scene, const RasterLoss& loss,
                                    const ref::ProjectForward<double>& exact, unsigned seed) {
    Noise noise(seed);
    RasterScene moved = scene;
    move_inputs(noise, moved);
    ref::ProjectForward<double> projected = ref::project_forward(moved);
    // The order is not a matter of rounding: equal depths stay in their order.
    std::sort(projected.order.begin(), projected.order.end());
    std::stable_sort(projected.order.begin(), projected.order.end(),
                     [&](std::uint32_t a, std::uint32_t b) {
                         return static_cast<float>(exact.gaussians[a].depth) <
                                static_cast<float>(exact.gaussians[b].depth);
                     });
    ref::ProjectForward<double> before = projected;
    move_projected(noise, scene, projected);
    RasterLoss weights = loss;
    noise.move_all(weights.grad_rgb);
    noise.move_all(weights.grad_alpha);
    noise.move_all(weights.grad_depth);
    return results_of(moved, projected, before, weights);
}

/// What gsplat's gradients of rotations keep along them, at most. With q off its length by e, q . grad_q = 2 s . grad_s
/// is taken off but for 2 e of it.
double left_along_rotations(const RasterScene& scene, const std::vector<double>& grad_scales) {
    if (scene.options.is_3dgs()) return 0;
    constexpr double kLength = ref::kRootRoundings + ref::kQuotientRoundings;
    double most = 0;
    for (std::size_t i = 0; 3 * i < grad_scales.size(); ++i) {
        double along = 0, square = 0;
        for (std::size_t k = 3 * i; k < 3 * i + 3; ++k)
            along += std::abs(scene.scales[k] * grad_scales[k]);
        for (std::size_t k = 4 * i; k < 4 * i + 4; ++k)
            square += scene.rotations[k] * scene.rotations[k];
        if (square > 0) most = std::max(most, 4 * kLength * kRounding * along / std::sqrt(square));
    }
    return most;
}

/// Other decisions on Gaussians that end within rounding of a rim of the image: rays see the box as it is, where
/// projections round it to whole pixels.
void decide_otherwise(const RasterScene& scene, const ref::ProjectForward<double>& projected,
                      std::map<std::string, Expected>& expected) {
    for (const char* name : {"means2d", "depths"}) {
        expected[name].other = expected[name].value;
        expected[name].other_allowed = expected[name].allowed;
    }
    // One pixel more on each side, in which those that were left out are seen.
    RasterScene wider = scene;
    const std::array<double, 2> size{static_cast<double>(scene.camera.width),
                                     static_cast<double>(scene.camera.height)};
    wider.camera.width += 2;
    wider.camera.height += 2;
    wider.camera.cx += 1;
    wider.camera.cy += 1;
    const ref::ProjectForward<double> around = ref::project_forward(wider);
    for (std::size_t i = 0; i < scene.count(); ++i) {
        const ref::ProjectedGaussian<double>& g = around.gaussians[i];
        if (!g.valid) continue;
        const double level =
            2 * std::log(g.opacity / static_cast<double>(splat::raster::kAlphaMin));
        for (std::size_t axis = 0; axis < 2; ++axis) {
            const auto [least, most] = ref::ray_extent(g, axis, level);
            const double mean = g.mean2d[axis];
            const auto ends_at = [&](double rim, double end) {
                return std::abs(end - rim) <=
                       kRayMargin * (std::abs(end - mean) + 1) + kRayMeanMargin * std::abs(mean);
            };
            if (!ends_at(1, most) && !ends_at(1 + size[axis], least)) continue;
            const bool seen = projected.gaussians[i].valid;
            expected["depths"].other[i] = seen ? 0 : g.depth;
            for (std::size_t k = 0; k < 2; ++k)
                expected["means2d"].other[2 * i + k] = seen ? 0 : g.mean2d[k] - 1;
        }
    }
}

std::vector<float> singles(const std::vector<double>& values) {
    return {values.begin(), values.end()};
}

}  // namespace

const char* const kRasterReason =
    "4 x the change of the tensor in float64 when inputs, projected numbers and weights of the "
    "loss "
    "move by the roundings that Vulkan allows what they come from (its condition), and 4 x 2^-24 "
    "(1 "
    "+ sqrt K) of its largest number for the K Gaussians of a pixel; of a gradient (64 + 5 sqrt "
    "K), "
    "for two factors of a conic and a quotient for each Gaussian; of rotations also what a "
    "quotient "
    "by their length leaves along them; along rays a Gaussian that ends within 1e-3 of a rim may "
    "be in the image or not";

std::map<std::string, Expected> raster_expected(const RasterScene& scene, const RasterLoss& loss,
                                                int samples) {
    const ref::ProjectForward<double> projected = ref::project_forward(scene);
    std::map<std::string, Expected> expected;
    std::map<std::string, double> change;
    for (auto& [name, values] : results_of(scene, projected, projected, loss))
        expected[name].value = std::move(values);
    for (int sample = 0; sample < samples; ++sample)
        for (const auto& [name, values] :
             moved_results(scene, loss, projected, static_cast<unsigned>(sample) + 1))
            for (std::size_t i = 0; i < values.size(); ++i)
                change[name] =
                    std::max(change[name], std::abs(values[i] - expected[name].value[i]));
    const std::vector<std::int64_t> blended = ref::blend_forward(scene, projected).n_contrib;
    const auto terms = static_cast<double>(*std::max_element(blended.begin(), blended.end()));
    if (!scene.options.is_ray())
        change["grad_rotations"] += left_along_rotations(scene, expected["grad_scales"].value);
    for (auto& [name, tensor] : expected) {
        double largest = 0;
        for (const double value : tensor.value) largest = std::max(largest, std::abs(value));
        // A gradient goes through two factors of a conic, and through a quotient for each Gaussian of a pixel.
        const bool gradient = name.starts_with("grad_");
        const double roundings = gradient ? 2 * kFactor + ref::kQuotientRoundings * std::sqrt(terms)
                                          : 1 + std::sqrt(terms);
        tensor.allowed.assign(tensor.value.size(),
                              4 * change[name] + 4 * kRounding * roundings * largest + 0x1p-119);
    }
    if (scene.options.is_ray()) decide_otherwise(scene, projected, expected);
    return expected;
}

RasterResults<float> published_in_float32(const RasterScene& scene, const RasterLoss& loss) {
    ref::RasterScene<float> single;
    single.means = singles(scene.means);
    single.scales = singles(scene.scales);
    single.rotations = singles(scene.rotations);
    single.opacities = singles(scene.opacities);
    single.sh = singles(scene.sh);
    single.sh_coefficients = scene.sh_coefficients;
    std::copy(scene.background.begin(), scene.background.end(), single.background.begin());
    const auto& camera = scene.camera;
    single.camera = {static_cast<float>(camera.fx),
                     static_cast<float>(camera.fy),
                     static_cast<float>(camera.cx),
                     static_cast<float>(camera.cy),
                     camera.width,
                     camera.height,
                     {}};
    std::copy(camera.world_to_camera.begin(), camera.world_to_camera.end(),
              single.camera.world_to_camera.begin());
    single.options = ref::raster_options<float>(scene.options.convention, scene.options.antialiased,
                                                scene.options.gradient);
    ref::ProjectForward<float> projected = ref::project_forward(single);
    for (auto& g : projected.gaussians) {
        if (!g.valid || g.ray.used) continue;
        g.det = g.cov[0] * g.cov[2] - g.cov[1] * g.cov[1];
        if (!(g.det > 0)) g.valid = false;
        g.conic = {g.cov[2] / g.det, -g.cov[1] / g.det, g.cov[0] / g.det};
    }
    projected.order.erase(
        std::remove_if(projected.order.begin(), projected.order.end(),
                       [&](std::uint32_t i) { return !projected.gaussians[i].valid; }),
        projected.order.end());
    const ref::RasterLoss<float> weights{singles(loss.grad_rgb), singles(loss.grad_alpha),
                                         singles(loss.grad_depth)};
    return results_of(single, projected, projected, weights);
}

}  // namespace vkrun::stress

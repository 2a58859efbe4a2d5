#include "stress/raster_bound.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace vkrun::stress {
namespace {

namespace ref = splat::ref;

/// Moves numbers by up to four roundings.
class Noise {
  public:
    explicit Noise(unsigned seed) : random_(seed) {}
    void move(double& number) { number *= 1 + 4 * kRounding * unit_(random_); }
    template <class Numbers>
    void move_all(Numbers& numbers) {
        for (double& number : numbers) move(number);
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

/// Not the conic: what it adds up from cancels in needles, which is up to the algorithm.
void move_projected(Noise& noise, ref::ProjectForward<double>& projected) {
    for (const std::uint32_t i : projected.order) {
        ref::ProjectedGaussian<double>& g = projected.gaussians[i];
        noise.move_all(g.mean2d);
        noise.move_all(g.color);
        noise.move_all(g.normal);
        noise.move(g.opacity);
        noise.move(g.depth);
    }
}

template <class Real>
RasterResults<Real> results_of(const ref::RasterScene<Real>& scene,
                               const ref::ProjectForward<Real>& projected,
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
        for (const Real value : g.conic) push("conics", value);
        push("depths", g.depth);
    }
    const ref::RasterBackward<Real> back =
        ref::project_backward(scene, projected, ref::blend_backward(scene, projected, loss));
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
    move_projected(noise, projected);
    RasterLoss weights = loss;
    noise.move_all(weights.grad_rgb);
    noise.move_all(weights.grad_alpha);
    noise.move_all(weights.grad_depth);
    return results_of(moved, projected, weights);
}

std::vector<float> singles(const std::vector<double>& values) {
    return {values.begin(), values.end()};
}

}  // namespace

const char* const kRasterReason =
    "4 x the largest change of the tensor in float64 when inputs, projected numbers and weights of "
    "the loss move by up to 4 roundings each (its condition), and 4 x 2^-24 (1 + sqrt K) of its "
    "largest number for the K Gaussians of a pixel";

std::map<std::string, Expected> raster_expected(const RasterScene& scene, const RasterLoss& loss,
                                                int samples) {
    const ref::ProjectForward<double> projected = ref::project_forward(scene);
    std::map<std::string, Expected> expected;
    std::map<std::string, double> change;
    for (auto& [name, values] : results_of(scene, projected, loss))
        expected[name].value = std::move(values);
    for (int sample = 0; sample < samples; ++sample)
        for (const auto& [name, values] :
             moved_results(scene, loss, projected, static_cast<unsigned>(sample) + 1))
            for (std::size_t i = 0; i < values.size(); ++i)
                change[name] =
                    std::max(change[name], std::abs(values[i] - expected[name].value[i]));
    const std::vector<std::int64_t> blended = ref::blend_forward(scene, projected).n_contrib;
    const auto terms = static_cast<double>(*std::max_element(blended.begin(), blended.end()));
    for (auto& [name, tensor] : expected) {
        double largest = 0;
        for (const double value : tensor.value) largest = std::max(largest, std::abs(value));
        tensor.allowed.assign(
            tensor.value.size(),
            4 * change[name] + 4 * kRounding * (1 + std::sqrt(terms)) * largest + 0x1p-119);
    }
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
        if (!g.valid) continue;
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
    return results_of(single, projected, weights);
}

}  // namespace vkrun::stress

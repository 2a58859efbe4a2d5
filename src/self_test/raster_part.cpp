#include <algorithm>
#include <cmath>

#include "gaussians/gaussian_set.h"
#include "raster/pack_camera.h"
#include "raster/rasterizer.h"
#include "self_test/parts.h"

namespace splat::self_test {
namespace {

/// Three round Gaussians on the optical axis, the farthest first, in an image of 24 x 16 pixels. Each covers a pixel at
/// distance d from the centre by alpha = opacity exp(-d^2 / (2 v)), v = f^2 scale^2 / z^2 + 0.3, and the nearer ones
/// cover the farther.
struct Axis {
    static constexpr std::size_t kCount = 3, kW = 24, kH = 16, kP = kW * kH;
    static constexpr double kF = 20, kScale = 0.2, kBackground = 1;
    static constexpr double kY0 =
        0.28209479177387814;  // 1 / (2 sqrt(pi)), of the constant harmonic
    static constexpr double kDepths[] = {4, 3, 2}, kOpacities[] = {0.9, 0.6, 0.3};
    static constexpr double kColors[3][3] = {{0.9, 0.2, 0.3}, {0.1, 0.8, 0.4}, {0.2, 0.3, 0.7}};

    Floats grad_image = integers(4 * kP, 16);  ///< RGB and alpha; the loss leaves alpha out
    Doubles image = Doubles(3 * kP);
    /// In the kernels' layout: mean, opacity; scale, 0; rotation, whose gradient is 0.
    Doubles gradients = Doubles(12 * kCount);
    Doubles color_gradients = Doubles(4 * kCount);

    Axis() {
        for (std::size_t p = 0; p < kP; ++p) grad_image[4 * p + 3] = 0;
        for (std::size_t p = 0; p < kP; ++p) add_pixel(p);
    }

    static double variance(std::size_t i) {
        return kF * kF * kScale * kScale / (kDepths[i] * kDepths[i]) + 0.3;
    }

    void add_pixel(std::size_t p) {
        const double dx = static_cast<double>(p % kW) + 0.5 - kW / 2.0;
        const double dy = static_cast<double>(p / kW) + 0.5 - kH / 2.0;
        double behind[3] = {kBackground, kBackground, kBackground}, alphas[kCount],
               before[kCount][3];
        for (std::size_t i = 0; i < kCount; ++i) {  // from the back
            alphas[i] = kOpacities[i] * std::exp(-(dx * dx + dy * dy) / (2 * variance(i)));
            if (alphas[i] < 1.0 / 255) alphas[i] = 0;
            for (std::size_t c = 0; c < 3; ++c) {
                before[i][c] = behind[c];
                behind[c] += alphas[i] * (kColors[i][c] - behind[c]);
            }
        }
        for (std::size_t c = 0; c < 3; ++c) image[3 * p + c] = behind[c];
        double left = 1;
        for (std::size_t i = kCount; i-- > 0; left *= 1 - alphas[i]) {
            double by_log_alpha = 0;
            for (std::size_t c = 0; c < 3; ++c) {
                const double g = wide(grad_image[4 * p + c]) * left * alphas[i];
                by_log_alpha += g * (kColors[i][c] - before[i][c]);
                color_gradients[4 * i + c] += g * kY0;
            }
            const double v = variance(i), focal = kF / kDepths[i];
            const double by_variance = by_log_alpha / (v * v) * focal * focal * kScale;
            double* to = &gradients[12 * i];
            to[0] += by_log_alpha * dx / v * focal;
            to[1] += by_log_alpha * dy / v * focal;
            to[3] += by_log_alpha / kOpacities[i];
            to[4] += by_variance * dx * dx;
            to[5] += by_variance * dy * dy;
        }
    }
};

struct Drawn {
    gaussians::GaussianSet scene;
    std::unique_ptr<raster::Rasterizer> rasterizer;
};

Result<Drawn> draw(vk::Context& context, raster::RasterDesc& desc, bool backward) {
    desc.gaussians = Axis::kCount;
    desc.width = Axis::kW;
    desc.height = Axis::kH;
    desc.convention = raster::Convention::kGsplat;
    desc.backward = backward;
    scene::Gaussians scene;
    for (std::size_t i = 0; i < Axis::kCount; ++i) {
        scene.means.insert(scene.means.end(), {0, 0, static_cast<float>(Axis::kDepths[i])});
        scene.log_scales.insert(scene.log_scales.end(), 3,
                                static_cast<float>(std::log(Axis::kScale)));
        scene.rotations.insert(scene.rotations.end(), {1, 0, 0, 0});
        const double opacity = Axis::kOpacities[i];
        scene.opacity_logits.push_back(static_cast<float>(std::log(opacity / (1 - opacity))));
        for (const double color : Axis::kColors[i])
            scene.sh.push_back(static_cast<float>((color - 0.5) / Axis::kY0));
    }
    scene::Camera camera{"self-test", Axis::kW,       Axis::kH,       Axis::kF,
                         Axis::kF,    Axis::kW / 2.0, Axis::kH / 2.0, {}};
    for (std::size_t i = 0; i < 16; i += 5) camera.world_to_camera[i] = 1;
    Drawn drawn;
    SPLAT_ASSIGN(drawn.rasterizer, raster::Rasterizer::create(context, desc));
    SPLAT_ASSIGN(drawn.scene, gaussians::allocate_set(context, desc));
    SPLAT_TRY(gaussians::upload(context, scene, drawn.scene));
    SPLAT_ASSIGN(const raster::PackedViews views,
                 raster::pack_views(desc, {&camera, 1}, {1, 1, 1}));
    SPLAT_TRY(drawn.rasterizer->forward(drawn.scene.views(), views));
    return drawn;
}

double largest(const Doubles& values) {
    double most = 0;
    for (const double value : values) most = std::max(most, std::abs(value));
    return most;
}

}  // namespace

Result<double> raster_error(vk::Context& context) {
    const Axis axis;
    raster::RasterDesc desc;
    SPLAT_ASSIGN(const Drawn drawn, draw(context, desc, false));
    Trial trial(context);
    SPLAT_ASSIGN(const Floats quads,
                 trial.get(drawn.rasterizer->workspace().image.range(), 4 * Axis::kP));
    Floats got(3 * Axis::kP);
    for (std::size_t i = 0; i < got.size(); ++i) got[i] = quads[i / 3 * 4 + i % 3];
    return distance(got, axis.image);
}

Result<double> raster_gradient_error(vk::Context& context) {
    const Axis axis;
    raster::RasterDesc desc;
    SPLAT_ASSIGN(const Drawn drawn, draw(context, desc, true));
    SPLAT_ASSIGN(const gaussians::GaussianSet to, gaussians::allocate_set(context, desc));
    Trial trial(context);
    SPLAT_ASSIGN(const vk::BufferView grad_image, trial.put(axis.grad_image));
    SPLAT_ASSIGN(const vk::BufferView grad_depth, trial.room(4 * Axis::kP));
    SPLAT_TRY(drawn.rasterizer->backward(grad_image, grad_depth, to.views()));
    SPLAT_ASSIGN(Floats got, trial.get(to.gaussians.range(), axis.gradients.size()));
    SPLAT_ASSIGN(const Floats colors, trial.get(to.colors.range(), axis.color_gradients.size()));
    for (std::size_t i = 0; i < Axis::kCount; ++i)
        got[12 * i + 2] = 0;  // z also moves the variance
    return std::max(distance(got, axis.gradients) / largest(axis.gradients),
                    distance(colors, axis.color_gradients) / largest(axis.color_gradients));
}

}  // namespace splat::self_test

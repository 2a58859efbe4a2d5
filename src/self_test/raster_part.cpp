#include <algorithm>
#include <array>
#include <cmath>

#include "gaussians/gaussian_set.h"
#include "raster/pack_camera.h"
#include "raster/radix_sort.h"
#include "raster/rasterizer.h"
#include "self_test/parts.h"

namespace splat::self_test {
namespace {

/// A round Gaussian on the optical axis.
struct Dot {
    double depth, opacity;
    std::array<double, 3> color;
};

std::vector<Dot> three_dots() {
    return {{4, 0.9, {0.9, 0.2, 0.3}}, {3, 0.6, {0.1, 0.8, 0.4}}, {2, 0.3, {0.2, 0.3, 0.7}}};
}

/// Each pixel's list is longer than a batch of blending, and every entry counts. Colours are above 0, below which they
/// are clamped and have no gradient.
std::vector<Dot> many_dots() {
    std::vector<Dot> dots;
    for (int i = 0; i < 200; ++i)
        dots.push_back({6 - 0.02 * i,
                        0.02 + 0.0001 * i,
                        {0.1 + i % 3 / 3.0, 0.1 + i % 5 / 5.0, 0.1 + i % 7 / 7.0}});
    return dots;
}

/// Dots, the farthest first, in an image of 24 x 16 pixels. Each covers a pixel at distance d from the centre by alpha
/// = opacity exp(-d^2 / (2 v)), v = f^2 scale^2 / z^2 + 0.3, and the nearer ones cover the farther.
struct Axis {
    static constexpr std::size_t kW = 24, kH = 16, kP = kW * kH;
    static constexpr double kF = 20, kScale = 0.2, kBackground = 1;
    static constexpr double kY0 =
        0.28209479177387814;  // 1 / (2 sqrt(pi)), of the constant harmonic

    std::vector<Dot> dots;
    Floats grad_image = integers(4 * kP, 16);  ///< RGB and alpha; the loss leaves alpha out
    Doubles image = Doubles(3 * kP);
    /// In the kernels' layout: mean, opacity; scale, 0; rotation, whose gradient is 0.
    Doubles gradients, color_gradients;

    explicit Axis(std::vector<Dot> of)
        : dots(std::move(of)), gradients(12 * dots.size()), color_gradients(4 * dots.size()) {
        for (std::size_t p = 0; p < kP; ++p) grad_image[4 * p + 3] = 0;
        for (std::size_t p = 0; p < kP; ++p) add_pixel(p);
    }

    [[nodiscard]] double variance(std::size_t i) const {
        return kF * kF * kScale * kScale / (dots[i].depth * dots[i].depth) + 0.3;
    }

    void add_pixel(std::size_t p) {
        const double dx = static_cast<double>(p % kW) + 0.5 - kW / 2.0;
        const double dy = static_cast<double>(p / kW) + 0.5 - kH / 2.0;
        std::array<double, 3> behind = {kBackground, kBackground, kBackground};
        std::vector<double> alphas(dots.size());
        std::vector<std::array<double, 3>> before(dots.size());
        for (std::size_t i = 0; i < dots.size(); ++i) {  // from the back
            alphas[i] = dots[i].opacity * std::exp(-(dx * dx + dy * dy) / (2 * variance(i)));
            if (alphas[i] < 1.0 / 255) alphas[i] = 0;
            before[i] = behind;
            for (std::size_t c = 0; c < 3; ++c)
                behind[c] += alphas[i] * (dots[i].color[c] - behind[c]);
        }
        for (std::size_t c = 0; c < 3; ++c) image[3 * p + c] = behind[c];
        double left = 1;
        for (std::size_t i = dots.size(); i-- > 0; left *= 1 - alphas[i]) {
            double by_log_alpha = 0;
            for (std::size_t c = 0; c < 3; ++c) {
                const double g = wide(grad_image[4 * p + c]) * left * alphas[i];
                by_log_alpha += g * (dots[i].color[c] - before[i][c]);
                color_gradients[4 * i + c] += g * kY0;
            }
            const double v = variance(i), focal = kF / dots[i].depth;
            const double by_variance = by_log_alpha / (v * v) * focal * focal * kScale;
            double* to = &gradients[12 * i];
            to[0] += by_log_alpha * dx / v * focal;
            to[1] += by_log_alpha * dy / v * focal;
            to[3] += by_log_alpha / dots[i].opacity;
            to[4] += by_variance * dx * dx;
            to[5] += by_variance * dy * dy;
        }
    }
};

struct Drawn {
    gaussians::GaussianSet scene;
    std::unique_ptr<raster::Rasterizer> rasterizer;
};

Result<Drawn> draw(vk::Context& context, const Axis& axis, raster::RasterDesc& desc,
                   bool backward) {
    desc.gaussians = static_cast<std::uint32_t>(axis.dots.size());
    desc.width = Axis::kW;
    desc.height = Axis::kH;
    desc.convention = raster::Convention::kGsplat;
    desc.backward = backward;
    scene::Gaussians scene;
    for (const Dot& dot : axis.dots) {
        scene.means.insert(scene.means.end(), {0, 0, static_cast<float>(dot.depth)});
        scene.log_scales.insert(scene.log_scales.end(), 3,
                                static_cast<float>(std::log(Axis::kScale)));
        scene.rotations.insert(scene.rotations.end(), {1, 0, 0, 0});
        scene.opacity_logits.push_back(
            static_cast<float>(std::log(dot.opacity / (1 - dot.opacity))));
        for (const double color : dot.color)
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

Result<double> image_error(vk::Context& context, const Axis& axis) {
    raster::RasterDesc desc;
    SPLAT_ASSIGN(const Drawn drawn, draw(context, axis, desc, false));
    Trial trial(context);
    SPLAT_ASSIGN(const Floats quads,
                 trial.get(drawn.rasterizer->workspace().image.range(), 4 * Axis::kP));
    Floats got(3 * Axis::kP);
    for (std::size_t i = 0; i < got.size(); ++i) got[i] = quads[i / 3 * 4 + i % 3];
    return distance(got, axis.image);
}

Result<double> gradient_error(vk::Context& context, const Axis& axis) {
    raster::RasterDesc desc;
    SPLAT_ASSIGN(const Drawn drawn, draw(context, axis, desc, true));
    SPLAT_ASSIGN(const gaussians::GaussianSet to, gaussians::allocate_set(context, desc));
    Trial trial(context);
    SPLAT_ASSIGN(const vk::BufferView grad_image, trial.put(axis.grad_image));
    SPLAT_ASSIGN(const vk::BufferView grad_depth, trial.room(4 * Axis::kP));
    SPLAT_TRY(drawn.rasterizer->backward(grad_image, grad_depth, to.views()));
    SPLAT_ASSIGN(Floats got, trial.get(to.gaussians.range(), axis.gradients.size()));
    SPLAT_ASSIGN(const Floats colors, trial.get(to.colors.range(), axis.color_gradients.size()));
    for (std::size_t i = 2; i < got.size(); i += 12) got[i] = 0;  // z also moves the variance
    return std::max(distance(got, axis.gradients) / largest(axis.gradients),
                    distance(colors, axis.color_gradients) / largest(axis.color_gradients));
}

/// The key of entries that a sort leaves out.
constexpr std::uint32_t kLeftOut = 0xFFFFFFFF;

/// 5,000 keys of 600 values in 15 bits, two digits that differ, so that most repeat and their order shows. The capacity
/// is that of several chunks. All 32 bits are sorted, where every 90th key is left out, or 15 with second values.
Result<double> sorted_error(vk::Context& context, bool second) {
    constexpr std::uint32_t kCount = 5000;
    const raster::RadixSortDesc desc{
        .capacity = 4 * 4096, .key_bits = second ? 15U : 32U, .second = second};
    std::vector<std::uint32_t> entries(2 * std::size_t{desc.capacity}), order, seconds;
    std::uint32_t state = 17;
    for (std::uint32_t i = 0; i < kCount; ++i) {
        state = state * 1664525U + 1013904223U;  // see integers()
        entries[2 * i] = !second && i % 90 == 89 ? kLeftOut : (state >> 16) % 600 * 53;
        entries[2 * i + 1] = i;
        seconds.push_back(state);
        if (entries[2 * i] != kLeftOut) order.push_back(i);
    }
    std::ranges::stable_sort(order, {}, [&](std::uint32_t i) { return entries[2 * i]; });
    Trial trial(context);
    raster::RadixSortViews views;
    for (vk::BufferView* view : {&views.input, &views.sides[0], &views.sides[1], &views.seconds[0],
                                 &views.seconds[1], &views.count, &views.kept})
        SPLAT_SET(*view, trial.room(4 * entries.size()));
    SPLAT_TRY(context.write(views.input, entries.data(), 4 * entries.size()));
    SPLAT_TRY(context.write(views.seconds[1], seconds.data(), 4 * seconds.size()));
    SPLAT_TRY(context.write(views.count, &kCount, 4));
    SPLAT_ASSIGN(const raster::RadixSortWorkspace space,
                 raster::allocate_radix_sort(context, desc));
    SPLAT_TRY(raster::radix_sort(trial.recorder(), desc, views, space));
    const std::uint32_t side = raster::radix_sort_side(trial.recorder(), desc);
    SPLAT_TRY(trial.run());
    std::uint32_t kept = 0;
    std::vector<std::uint32_t> got(2 * order.size()), got_seconds(order.size());
    SPLAT_TRY(context.read(views.kept, &kept, 4));
    SPLAT_TRY(context.read(views.sides[side], got.data(), 4 * got.size()));
    SPLAT_TRY(context.read(views.seconds[side], got_seconds.data(), 4 * got_seconds.size()));
    double wrong = kept == order.size() ? 0 : 1;
    for (std::size_t i = 0; i < order.size(); ++i)
        if (got[2 * i] != entries[2 * order[i]] || got[2 * i + 1] != order[i] ||
            (second && got_seconds[i] != seconds[order[i]]))
            ++wrong;
    return wrong;
}

}  // namespace

Result<double> sort_error(vk::Context& context) {
    SPLAT_ASSIGN(const double first, sorted_error(context, false));
    SPLAT_ASSIGN(const double both, sorted_error(context, true));
    return first + both;
}

Result<double> raster_error(vk::Context& context) {
    return image_error(context, Axis(three_dots()));
}

Result<double> raster_gradient_error(vk::Context& context) {
    return gradient_error(context, Axis(three_dots()));
}

Result<double> raster_list_error(vk::Context& context) {
    return image_error(context, Axis(many_dots()));
}

Result<double> raster_list_gradient_error(vk::Context& context) {
    return gradient_error(context, Axis(many_dots()));
}

}  // namespace splat::self_test

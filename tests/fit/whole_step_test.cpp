// One whole step of a fit against float64: the loss of two views as the references draw it, its gradient with respect
// to the parameters, and the update.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "fit/fit_set_ref.h"
#include "fit/fitter.h"
#include "fit/prior_maps.h"
#include "ops/op_harness.h"
#include "ref/losses/photo_loss_ref.h"
#include "ref/losses/prior_loss_ref.h"
#include "ref/rasterize_ref.h"
#include "scene/arrays.h"
#include "scene/camera_pose.h"
#include "support/raster_tolerances.h"
#include "support/rng_fill.h"

namespace splat::test::whole_step {
namespace {

constexpr std::size_t kCount = 12, kOwn = 12, kRow = kOwn + 48;  ///< numbers of a Gaussian
constexpr std::uint32_t kWidth = 24, kHeight = 20;
constexpr std::uint64_t kSteps = 20;
constexpr std::array<float, 3> kBackground = {0.1F, 0.2F, 0.3F};

/// Parameters of all Gaussians, or a gradient: [kCount,kRow], those of FitGaussian, then the harmonics.
using Numbers = std::vector<double>;
struct View : data::PosedPhoto {
    double prior_decay = 1;  ///< factor of the weights of losses against maps
};
const fit::PriorAlignment kAlignment = {0.3, 0.12, 0.25};
constexpr double kDepthWeight = 0.2, kNormalWeight = 0.1;
using Drawn = ref::BlendForward<double>;

/// A term of a view's loss: returns its value, and adds `share` of its gradient to that of what is drawn, if wanted.
using Term = double (*)(const View& view, const Drawn& drawn, double share,
                        ref::RasterLoss<double>* grad);

double photograph_term(const View& view, const Drawn& drawn, double share,
                       ref::RasterLoss<double>* grad) {
    ref::PhotoLossInput in{view.height, view.width, 0.2, Numbers(drawn.rgb.size()), view.pixels};
    const auto plane = [&](std::size_t i) { return i % 3 * in.pixels() + i / 3; };
    for (std::size_t i = 0; i < drawn.rgb.size(); ++i) in.image[plane(i)] = drawn.rgb[i];
    if (grad != nullptr) {
        const Numbers by_image = ref::photo_loss_backward<double>(in);
        for (std::size_t i = 0; i < by_image.size(); ++i)
            grad->grad_rgb[i] += share * by_image[plane(i)];
    }
    return ref::photo_loss_forward<double>(in);
}

double prior_term(const View& view, const Drawn& drawn, double share,
                  ref::RasterLoss<double>* grad) {
    const scene::Camera& camera = view.camera;
    ref::PriorLossInput in;
    in.height = view.height;
    in.width = view.width;
    in.fx = camera.fx;
    in.fy = camera.fy;
    in.cx = camera.cx;
    in.cy = camera.cy;
    in.depth_weight = kDepthWeight * view.prior_decay;
    in.normal_weight = kNormalWeight * view.prior_decay;
    in.scale = kAlignment.scale;
    in.shift = kAlignment.shift;
    in.mean = kAlignment.mean;
    in.depth = drawn.depth;
    in.alpha = drawn.alpha;
    in.nearness.assign(in.pixels(), std::nan(""));
    in.normals.resize(in.pixels());
    fit::PriorCounts counts;
    const std::vector<std::uint32_t> map = fit::packed_maps(view, counts);
    for (std::size_t i = 0; i < in.pixels(); ++i) {
        const std::uint32_t word = map[2 * i + 1];
        if ((word & fit::kMapDepth) != 0)
            in.nearness[i] = static_cast<double>(std::bit_cast<float>(map[2 * i]));
        if ((word & fit::kMapNormal) == 0) continue;
        std::array<double, 3>& normal = in.normals[i];
        for (std::size_t c = 0; c < 3; ++c) normal[c] = (word >> (8 * c) & 255) / 127.5 - 1;
        const double length = std::sqrt(ref::dot_of(normal, normal));
        for (double& number : normal) number /= length;
    }
    const ref::PriorLossOutput<double> found = ref::prior_loss<double>(in);
    for (std::size_t i = 0; grad != nullptr && i < in.pixels(); ++i) {
        grad->grad_depth[i] += share * found.grad_depth[i];
        grad->grad_alpha[i] += share * found.grad_alpha[i];
    }
    return in.depth_weight * found.depth + in.normal_weight * found.normal;
}

/// Every loss that a step has.
constexpr Term kTerms[] = {photograph_term, prior_term};

ref::RasterScene<double> scene_of(const Numbers& raw, const View& view, std::uint32_t degree) {
    ref::RasterScene<double> scene;
    scene.sh_coefficients = scene::sh_coefficients(degree);
    for (std::size_t i = 0; i < kCount; ++i) {
        const double* const row = &raw[i * kRow];
        scene.means.insert(scene.means.end(), row, row + 3);
        scene.opacities.push_back(ref::sigmoid(row[3]));
        for (std::size_t k = 4; k < 7; ++k) scene.scales.push_back(std::exp(row[k]));
        scene.rotations.insert(scene.rotations.end(), row + 8, row + 12);
        scene.sh.insert(scene.sh.end(), row + kOwn, row + kOwn + 3 * scene.sh_coefficients);
    }
    std::copy(kBackground.begin(), kBackground.end(), scene.background.begin());
    const auto as_float = [](double value) {
        return static_cast<double>(static_cast<float>(value));
    };
    const scene::Camera& camera = view.camera;
    scene.camera = {as_float(camera.fx),
                    as_float(camera.fy),
                    as_float(camera.cx),
                    as_float(camera.cy),
                    camera.width,
                    camera.height,
                    {}};
    std::transform(camera.world_to_camera.begin(), camera.world_to_camera.end(),
                   scene.camera.world_to_camera.begin(), as_float);
    return scene;
}

/// The loss of a step, and its gradient with respect to the parameters.
double step_loss(const Numbers& raw, const std::vector<View>& views, std::uint32_t degree,
                 Numbers* gradient) {
    const double share = 1 / static_cast<double>(views.size());
    double loss = 0;
    for (const View& view : views) {
        const ref::RasterScene<double> scene = scene_of(raw, view, degree);
        const std::size_t pixels = scene.pixels();
        ref::RasterLoss<double> by_drawn{Numbers(3 * pixels), Numbers(pixels), Numbers(pixels)};
        const Drawn drawn = ref::rasterize_forward(scene);
        for (const Term term : kTerms)
            loss += share * term(view, drawn, share, gradient != nullptr ? &by_drawn : nullptr);
        if (gradient == nullptr) continue;
        const ref::RasterBackward<double> back = ref::rasterize_backward(scene, by_drawn);
        for (std::size_t i = 0; i < kCount; ++i) {
            ref::FitGaussian own{}, raw_own{};
            std::copy_n(&raw[i * kRow], kOwn, raw_own.begin());
            std::copy_n(&back.grad_means[3 * i], 3, own.begin());
            own[3] = back.grad_opacities[i];
            std::copy_n(&back.grad_scales[3 * i], 3, own.begin() + 4);
            std::copy_n(&back.grad_rotations[4 * i], 4, own.begin() + 8);
            own = ref::fit_chain(raw_own, own);
            double* const to = &(*gradient)[i * kRow];
            for (std::size_t k = 0; k < kOwn; ++k) to[k] += own[k];
            const std::size_t harmonics = 3 * scene.sh_coefficients;
            for (std::size_t k = 0; k < harmonics; ++k)
                to[kOwn + k] += back.grad_sh[i * harmonics + k];
        }
    }
    return loss;
}

/// Numbers of a row with one rate.
struct Attribute {
    const char* name;
    std::size_t from, to;
    double fit::Rates::*rate;
};
constexpr Attribute kAttributes[] = {{"means", 0, 3, &fit::Rates::mean},
                                     {"logits", 3, 4, &fit::Rates::logit},
                                     {"log scales", 4, 7, &fit::Rates::log_scale},
                                     {"rotations", 8, 12, &fit::Rates::rotation},
                                     {"constant harmonics", 12, 15, &fit::Rates::constant},
                                     {"other harmonics", 15, kRow, &fit::Rates::rest}};

double largest(const Numbers& numbers, const Attribute& of) {
    double most = 0;
    for (std::size_t i = 0; i < numbers.size(); ++i)
        if (i % kRow >= of.from && i % kRow < of.to) most = std::max(most, std::abs(numbers[i]));
    return most;
}

scene::Gaussians random_scene() {
    scene::Gaussians scene = scene::make_gaussians(kCount, 3);
    scene.means = normal_fill(3 * kCount, 1, 0, 0.5);
    scene.log_scales = normal_fill(3 * kCount, 2, -1.3, 0.4);
    scene.rotations = normal_fill(4 * kCount, 3);
    scene.opacity_logits = normal_fill(kCount, 4, 0.5, 1);
    scene.sh = normal_fill(48 * kCount, 5, 0.1, 0.3);
    return scene;
}

std::vector<data::PosedPhoto> random_photographs() {
    std::vector<data::PosedPhoto> photos;
    Rng rng(6);
    for (const double side : {-1.0, 1.0}) {
        data::PosedPhoto& photo = photos.emplace_back();
        photo.camera = need(scene::camera_from_fov(kWidth, kHeight, 0.7));
        photo.camera.world_to_camera = need(scene::look_at({side, 0.4, -4}, {0, 0, 0}, scene::kUp));
        photo.width = kWidth;
        photo.height = kHeight;
        for (std::size_t p = 0; p < std::size_t{kWidth} * kHeight; ++p) {
            std::uint32_t word = p % 11 == 0 ? 0 : 255U << 24;  // some pixels are not there
            for (std::uint32_t c = 0; c < 3; ++c)
                word |= static_cast<std::uint32_t>(40 + 9 * (p / kWidth) + rng.below(30))
                        << (8 * c);
            photo.pixels.push_back(word);
            photo.nearness.push_back(p % 7 == 0 ? std::nanf("")
                                                : static_cast<float>(rng.uniform()));
            const std::uint64_t tilt = rng.next();
            photo.normals.push_back((tilt & 0x3F7F7F) | 255U << 24);  // towards the camera
        }
    }
    return photos;
}

std::vector<View> reduced(const std::vector<data::PosedPhoto>& photos, std::uint32_t factor,
                          double prior_decay) {
    std::vector<View> views;
    for (const data::PosedPhoto& photo : photos)
        views.push_back({data::reduce(photo, factor), prior_decay});
    return views;
}

TEST(WholeStepReference, IsTheSlopeOfTheLoss) {
    const scene::Gaussians scene = random_scene();
    const std::vector<View> views = reduced(random_photographs(), 2, 0.5);
    Numbers raw(kCount * kRow), gradient(kCount * kRow);
    for (std::size_t i = 0; i < kCount; ++i) {
        double* const row = &raw[i * kRow];
        std::copy_n(&scene.means[3 * i], 3, row);
        row[3] = static_cast<double>(scene.opacity_logits[i]);
        std::copy_n(&scene.log_scales[3 * i], 3, row + 4);
        std::copy_n(&scene.rotations[4 * i], 4, row + 8);
        std::copy_n(&scene.sh[48 * i], 48, row + kOwn);
    }
    step_loss(raw, views, 3, &gradient);
    // A small one: where a Gaussian's rim or the sign of a difference crosses a pixel, the loss has a corner.
    constexpr double kStep = 1e-7;
    for (std::size_t i = 0; i < raw.size(); ++i) {
        Numbers at = raw;
        at[i] = raw[i] + kStep;
        const double above = step_loss(at, views, 3, nullptr), x_above = at[i];
        at[i] = raw[i] - kStep;
        const double numeric = (above - step_loss(at, views, 3, nullptr)) / (x_above - at[i]);
        EXPECT_NEAR(gradient[i], numeric, 1e-8 + 1e-6 * std::abs(numeric)) << i;
    }
}

class WholeStep : public KernelsTest {
  protected:
    /// A fitter, and the loss and its gradient that it should have in a step, from 0.
    void begin(std::uint64_t step) {
        step_ = step;
        fit::Fitter::Desc desc{.photos = random_photographs(),
                               .schedule = fit::Schedule::of_steps({.gaussians = kCount,
                                                                    .most_gaussians = kCount,
                                                                    .pixels = kWidth * kHeight,
                                                                    .extent = 4},
                                                                   kSteps),
                               .background = kBackground,
                               .priors = {kDepthWeight, kNormalWeight, {kAlignment, kAlignment}}};
        plan_ = desc.schedule.at(step);
        rates_ = desc.schedule.rates(static_cast<double>(plan_.fraction));
        const std::vector<View> views =
            reduced(desc.photos, plan_.factor, std::pow(0.01, static_cast<double>(plan_.fraction)));
        fitter_ = need(fit::Fitter::create(context(), std::move(desc)));
        ASSERT_OK(fitter_->begin(random_scene()));
        raw_ = read("gaussians", "colors");
        gradient_.assign(raw_.size(), 0);
        loss_ = step_loss(raw_, views, plan_.degree, &gradient_);
    }

    /// Two arrays of the fitter's state as rows.
    Numbers read(const char* own, const char* harmonics) {
        io::NamedTensors state;
        EXPECT_OK(fitter_->save(state));
        Numbers numbers(kCount * kRow);
        for (std::size_t i = 0; i < numbers.size(); ++i) {
            const std::size_t row = i / kRow, k = i % kRow;
            numbers[i] =
                static_cast<double>(k < kOwn ? state.find(own)->values[row * kOwn + k]
                                             : state.find(harmonics)->values[row * 48 + k - kOwn]);
        }
        return numbers;
    }
    /// Replace the moments.
    void load_moments(const Numbers& m, const Numbers& v) {
        io::NamedTensors before, after;
        ASSERT_OK(fitter_->save(before));
        for (std::size_t t = 0; t < before.size(); ++t) {
            io::NamedTensor tensor = before[t];
            const bool first = tensor.name.starts_with("m:"),
                       own = tensor.name.ends_with(":gaussians");
            if (first || tensor.name.starts_with("v:")) {
                LargeVector<float>& values = tensor.values.own();
                const std::size_t length = own ? kOwn : 48;
                for (std::size_t i = 0; i < values.size(); ++i)
                    values[i] = static_cast<float>(
                        (first ? m : v)[i / length * kRow + (own ? 0 : kOwn) + i % length]);
            }
            ASSERT_OK(after.add(std::move(tensor)));
        }
        ASSERT_OK(fitter_->load(after, 0, {}));
    }
    void step() {
        fit::FitStep done;
        ASSERT_OK(fitter_->step(step_, 0, done));
        ASSERT_FALSE(done.skipped);
        EXPECT_NEAR(done.loss, loss_, 2e-6);
    }

    std::uint64_t step_ = 0;
    fit::StepPlan plan_;
    fit::Rates rates_;
    std::unique_ptr<fit::Fitter> fitter_;
    Numbers raw_, gradient_;
    double loss_ = 0;
};
SPLAT_INSTANTIATE_KERNELS(WholeStep);

/// Views at a quarter with constant harmonics, and whole ones with all of them.
constexpr std::uint64_t kTried[] = {0, kSteps - 1};

TEST_P(WholeStep, GradientMatchesFloat64) {
    for (const std::uint64_t tried : kTried) {
        SCOPED_TRACE(tried);
        begin(tried);
        step();
        // Moments were 0, so the first ones are a tenth of the gradient.
        const Numbers m = read("m:gaussians", "m:colors");
        for (const Attribute& of : kAttributes) {
            const double most = largest(gradient_, of);
            if (std::string(of.name) != "other harmonics" || plan_.degree > 0) {
                EXPECT_GT(most, 1e-5) << of.name;
            }
            for (std::size_t i = 0; i < m.size(); ++i) {
                if (i % kRow < of.from || i % kRow >= of.to) continue;
                EXPECT_NEAR(m[i] / (1 - rates_.beta1), gradient_[i],
                            raster_tolerance("gradient").usual * most)
                    << of.name << " " << i;
            }
        }
    }
}

TEST_P(WholeStep, UpdateMatchesFloat64) {
    for (const std::uint64_t tried : kTried) {
        SCOPED_TRACE(tried);
        begin(tried);
        // Moments of the gradient's size, so that the update depends on it.
        ref::AdamState state{raw_, Numbers(raw_.size()), Numbers(raw_.size())};
        Numbers rate(raw_.size());
        const std::size_t active = kOwn + 3 * scene::sh_coefficients(plan_.degree);
        Rng rng(7);
        for (const Attribute& of : kAttributes) {
            const double most = std::max(largest(gradient_, of), 1e-6);
            for (std::size_t i = 0; i < raw_.size(); ++i) {
                if (i % kRow < of.from || i % kRow >= of.to) continue;
                if (i % kRow >= active) continue;
                rate[i] = rates_.*of.rate;
                state.m[i] = static_cast<float>(0.2 * most * (rng.uniform() - 0.5));
                state.v[i] = static_cast<float>(0.02 * most * most * (0.5 + rng.uniform()));
            }
        }
        load_moments(state.m, state.v);
        step();
        const Numbers now = read("gaussians", "colors");
        for (std::size_t i = 0; i < raw_.size(); ++i) {
            ref::AdamState one{{raw_[i]}, {state.m[i]}, {state.v[i]}};
            ref::adam_step({.learning_rate = rate[i]}, tried + 1, {gradient_[i]}, one);
            EXPECT_NEAR(now[i], one.value[0], 1e-7 * std::abs(raw_[i]) + 5e-5 * rate[i]) << i;
        }
    }
}

}  // namespace
}  // namespace splat::test::whole_step

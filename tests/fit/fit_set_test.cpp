#include "fit/fit_set.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "fit/fit_set_ref.h"
#include "ops/op_harness.h"
#include "params/fit_params.h"
#include "scene/arrays.h"
#include "support/gpu_buffers.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

constexpr std::uint32_t kCount = 77, kCapacity = 130;

class FitSetTest : public KernelsTest {
  protected:
    static scene::Gaussians random_scene(std::uint32_t degree) {
        scene::Gaussians scene = scene::make_gaussians(kCount, degree);
        std::uint64_t seed = 10;
        for (std::vector<float>* array :
             {&scene.means, &scene.log_scales, &scene.rotations, &scene.opacity_logits, &scene.sh})
            *array = normal_fill(array->size(), ++seed);
        return scene;
    }
    fit::FitSet set_of(const scene::Gaussians& scene) {
        fit::FitSet set = need(fit::FitSet::create(context(), kCapacity, 3));
        EXPECT_OK(set.begin(scene));
        return set;
    }
    static std::vector<float> tensor(fit::FitSet& set, const char* name) {
        io::NamedTensors tensors;
        EXPECT_OK(set.save(tensors));
        return tensors.find(name)->values;
    }
    std::vector<float> read(const vk::BufferView& view, std::size_t count) {
        std::vector<float> values(count);
        EXPECT_OK(context().read(view, values.data(), count * sizeof(float)));
        return values;
    }
    void write(const vk::BufferView& view, const std::vector<float>& values) {
        EXPECT_OK(context().write(view, values.data(), values.size() * sizeof(float)));
    }
    void update(fit::FitSet& set, const fit::Rates& rates, std::uint64_t step, std::uint32_t degree,
                const vk::Buffer& exported, std::uint32_t views) {
        vk::Recorder recorder(context());
        ASSERT_OK(set.update(recorder, rates, step, degree, exported.range(), views));
        vk::CommandList list = need(recorder.finish());
        ASSERT_OK(context().run(list));
    }
};
SPLAT_INSTANTIATE_KERNELS(FitSetTest);

constexpr fit::Rates kRates = {.mean = 0.02,
                               .logit = 0.05,
                               .log_scale = 0.005,
                               .rotation = 0.001,
                               .constant = 0.0025,
                               .rest = 0.0004};

/// Rate of each number of a Gaussian.
double rate_of(std::size_t k) {
    return k < 3 ? kRates.mean : k == 3 ? kRates.logit : k < 8 ? kRates.log_scale : kRates.rotation;
}

TEST_P(FitSetTest, UpdateMatchesFloat64) {
    constexpr std::uint64_t kSteps = 4;
    const scene::Gaussians scene = random_scene(3);
    fit::FitSet set = set_of(scene);
    std::vector<ref::AdamState> states(kCount);
    const std::vector<float> first = tensor(set, "gaussians");
    for (std::size_t i = 0; i < kCount; ++i)
        states[i] = {{first.begin() + 12 * i, first.begin() + 12 * (i + 1)},
                     std::vector<double>(12),
                     std::vector<double>(12)};
    const vk::Buffer exported = upload(context(), std::vector<float>(kCount * 12, 0));
    for (std::uint64_t step = 1; step <= kSteps; ++step) {
        const std::vector<float> grads = normal_fill(kCount * 12, 50 + step, 0, 0.1);
        write(set.gradients(3).gaussians, grads);
        update(set, kRates, step, 3, exported, 1);
        for (std::size_t i = 0; i < kCount; ++i) {
            ref::FitGaussian raw{}, grad{};
            std::copy_n(states[i].value.begin(), 12, raw.begin());
            std::copy_n(grads.begin() + 12 * i, 12, grad.begin());
            grad = ref::fit_chain(raw, grad);
            // Adam's rule of each number on its own.
            for (std::size_t k = 0; k < 12; ++k) {
                ref::AdamState one{{raw[k]}, {states[i].m[k]}, {states[i].v[k]}};
                ref::adam_step({.learning_rate = rate_of(k)}, step, {grad[k]}, one);
                states[i].value[k] = one.value[0];
                states[i].m[k] = one.m[0];
                states[i].v[k] = one.v[0];
            }
        }
    }
    const std::vector<float> raw = tensor(set, "gaussians");
    const std::vector<float> drawn = read(set.drawn(3).gaussians, kCount * 12);
    for (std::size_t i = 0; i < kCount * 12; ++i) {
        const double expected = states[i / 12].value[i % 12];
        // A step moves a parameter by up to its rate, of which some 1e-5 is rounding; then it is rounded.
        const double allowed = 4 * (2e-7 * std::abs(expected) + 1e-5 * rate_of(i % 12));
        EXPECT_NEAR(raw[i], expected, allowed) << i;
        const std::size_t k = i % 12;
        const auto value = static_cast<double>(raw[i]);
        const double activated = k == 3           ? ref::sigmoid(value)
                                 : k > 3 && k < 7 ? std::exp(value)
                                 : k == 7         ? 0
                                                  : value;
        EXPECT_NEAR(drawn[i], activated, 1e-6 * std::max(1.0, activated)) << i;
    }
}

TEST_P(FitSetTest, ColorsMoveByTheirRatesUpToTheActiveDegree) {
    const scene::Gaussians scene = random_scene(3);
    for (const std::uint32_t degree : {0U, 1U, 2U, 3U}) {
        fit::FitSet set = set_of(scene);
        // The first step of Adam has the length of the rate.
        const std::size_t active = 3 * scene::sh_coefficients(degree);
        std::vector<float> grads(kCount * 48, 0);
        for (std::size_t i = 0; i < grads.size(); ++i) grads[i] = i % 48 < active ? 0.5F : 0.0F;
        write(set.gradients(degree).colors, grads);
        const vk::Buffer exported = upload(context(), std::vector<float>(kCount * 12, 0));
        update(set, kRates, 1, degree, exported, 1);
        const std::vector<float> colors = tensor(set, "colors");
        for (std::size_t i = 0; i < colors.size(); ++i) {
            const double rate = i % 48 < 3 ? kRates.constant : i % 48 < active ? kRates.rest : 0;
            EXPECT_NEAR(colors[i], static_cast<double>(scene.sh[i]) - rate, 1e-6) << i;
            if (rate == 0) {
                EXPECT_EQ(colors[i], scene.sh[i]) << i;
            }
        }
    }
}

TEST_P(FitSetTest, StatisticsAreMeansOverTheViewsThatSaw) {
    fit::FitSet set = set_of(random_scene(1));
    std::vector<float> exported(2 * kCount * 12, 0);
    const auto absolute = [&](std::size_t view, std::size_t i) {
        return &exported[(view * kCount + i) * 12 + 2];
    };
    absolute(0, 5)[0] = 3;
    absolute(0, 5)[1] = 4;
    absolute(1, 5)[0] = 1;
    absolute(1, 7)[1] = 2;
    absolute(0, 9)[0] = std::numeric_limits<float>::quiet_NaN();
    const vk::Buffer buffer = upload(context(), exported);
    update(set, kRates, 1, 1, buffer, 2);
    update(set, kRates, 2, 1, buffer, 0);  // no longer summed
    const std::vector<fit::Score> scores = need(set.scores());
    ASSERT_EQ(scores.size(), kCount);
    for (std::size_t i = 0; i < kCount; ++i)
        EXPECT_EQ(scores[i].gradient, i == 5 ? 3.0F : i == 7 ? 2.0F : 0.0F) << i;
}

TEST_P(FitSetTest, GradientsThatAreNotFiniteMoveNothing) {
    const scene::Gaussians scene = random_scene(0);
    fit::FitSet set = set_of(scene);
    std::vector<float> grads(kCount * 12, 0);
    grads[12 * 3] = std::numeric_limits<float>::infinity();
    grads[12 * 4 + 5] = std::numeric_limits<float>::quiet_NaN();
    write(set.gradients(0).gaussians, grads);
    const vk::Buffer exported = upload(context(), std::vector<float>(kCount * 12, 0));
    const std::vector<float> before = tensor(set, "gaussians");
    update(set, kRates, 1, 0, exported, 1);
    EXPECT_EQ(tensor(set, "gaussians"), before);
}

TEST_P(FitSetTest, RearrangedRowsAreThoseOfTheReference) {
    fit::FitSet set = set_of(random_scene(2));
    const vk::Buffer exported = upload(context(), std::vector<float>(kCount * 12, 1));
    write(set.gradients(2).gaussians, normal_fill(kCount * 12, 3));
    write(set.gradients(2).colors, normal_fill(kCount * 48, 4));
    update(set, kRates, 1, 2, exported, 1);
    const std::vector<float> raw = tensor(set, "gaussians"), colors = tensor(set, "colors"),
                             m = tensor(set, "m:gaussians"), v = tensor(set, "v:colors");
    std::vector<fit::Row> rows;
    for (std::uint32_t i = 1; i < kCount; ++i)  // row 0 leaves
        rows.push_back({i, i % 3 == 0 ? params::kFitSecondHalf : params::kFitKeep});
    for (std::uint32_t i = 3; i < kCount; i += 3) rows.push_back({i, params::kFitFirstHalf});
    vk::Recorder recorder(context());
    ASSERT_OK(set.rearrange(recorder, rows));
    vk::CommandList list = need(recorder.finish());
    ASSERT_OK(context().run(list));
    set.rearranged(rows);
    ASSERT_EQ(set.count(), rows.size());
    const std::vector<float> now = tensor(set, "gaussians"), now_colors = tensor(set, "colors"),
                             now_m = tensor(set, "m:gaussians"), now_v = tensor(set, "v:colors");
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const std::size_t from = rows[i].source;
        ref::FitGaussian expected{};
        std::copy_n(raw.begin() + static_cast<std::ptrdiff_t>(12 * from), 12, expected.begin());
        const bool kept = rows[i].role == params::kFitKeep;
        if (!kept)
            expected = ref::fit_half(expected, rows[i].role == params::kFitFirstHalf ? 1 : -1);
        for (std::size_t k = 0; k < 12; ++k) {
            if (kept) {
                EXPECT_EQ(now[12 * i + k], raw[12 * from + k]);
            } else {
                EXPECT_NEAR(now[12 * i + k], expected[k],
                            3e-6 * std::max(1.0, std::abs(expected[k])));
            }
            EXPECT_EQ(now_m[12 * i + k], kept ? m[12 * from + k] : 0);
        }
        for (std::size_t k = 0; k < 48; ++k) {
            EXPECT_EQ(now_colors[48 * i + k], colors[48 * from + k]);
            EXPECT_EQ(now_v[48 * i + k], kept ? v[48 * from + k] : 0);
        }
    }
    for (const fit::Score& score : need(set.scores())) EXPECT_EQ(score.gradient, 0);
}

TEST_P(FitSetTest, SharesHaveTheirLogitsAndScales) {
    fit::FitSet set = set_of(random_scene(1));
    const std::vector<float> raw = tensor(set, "gaussians"), colors = tensor(set, "colors");
    const std::vector<fit::Row> rows = {
        {2, params::kFitShare, -3.25F, -0.5F}, {1}, {2, params::kFitShare, -3.25F, -0.5F}};
    vk::Recorder recorder(context());
    ASSERT_OK(set.rearrange(recorder, rows));
    vk::CommandList list = need(recorder.finish());
    ASSERT_OK(context().run(list));
    set.rearranged(rows);
    const std::vector<float> now = tensor(set, "gaussians"), now_colors = tensor(set, "colors");
    ASSERT_EQ(now.size(), 36);
    for (std::size_t i = 0; i < 36; ++i) {
        const std::size_t row = i / 12, k = i % 12;
        const float before = raw[12 * rows[row].source + k];
        EXPECT_EQ(now[i], row == 1         ? before
                          : k == 3         ? -3.25F
                          : k > 3 && k < 7 ? before - 0.5F
                                           : before)
            << i;
    }
    for (std::size_t k = 0; k < 48; ++k) EXPECT_EQ(now_colors[k], colors[48 * 2 + k]);
}

TEST_P(FitSetTest, NoiseMatchesFloat64) {
    scene::Gaussians scene = random_scene(0);
    for (float& logit : scene.opacity_logits) logit = -5 + 0.5F * logit;
    scene.rotations[4 * 9] = scene.rotations[4 * 9 + 1] = scene.rotations[4 * 9 + 2] =
        scene.rotations[4 * 9 + 3] = 0;  // no direction: it stays
    fit::FitSet set = set_of(scene), same = set_of(scene), other = set_of(scene);
    const std::vector<float> first = tensor(set, "gaussians");
    const vk::Buffer exported = upload(context(), std::vector<float>(kCount * 12, 0));
    fit::Rates rates = {.noise = 0.3, .seed = 77};
    update(set, rates, 5, 0, exported, 0);
    update(same, rates, 5, 0, exported, 0);
    rates.seed = 78;
    update(other, rates, 5, 0, exported, 0);
    const std::vector<float> moved = tensor(set, "gaussians");
    const std::vector<float> drawn = read(set.drawn(0).gaussians, kCount * 12);
    EXPECT_EQ(moved, tensor(same, "gaussians"));
    EXPECT_NE(moved, tensor(other, "gaussians"));
    for (std::size_t i = 0; i < kCount; ++i) {
        ref::FitGaussian raw{};
        std::copy_n(&first[12 * i], 12, raw.begin());
        const auto expected = ref::fit_noise(raw, 0.3, static_cast<std::uint32_t>(i), 5, 77);
        for (std::size_t k = 0; k < 12; ++k) {
            const auto before = static_cast<double>(first[12 * i + k]);
            if (k > 2 || i == 9) {
                EXPECT_EQ(moved[12 * i + k], first[12 * i + k]) << i << ' ' << k;
                continue;
            }
            // Logarithms and the gate's exponential are 1e-5 off on some devices.
            const double allowed = 2e-7 * std::abs(before) + 1e-4 * std::exp(2 * raw[4]) +
                                   1e-4 * std::exp(2 * raw[5]) + 1e-4 * std::exp(2 * raw[6]);
            EXPECT_NEAR(moved[12 * i + k], expected[k], allowed) << i << ' ' << k;
            EXPECT_EQ(drawn[12 * i + k], moved[12 * i + k]);
        }
    }
}

TEST_P(FitSetTest, RegularisersPullOpacitiesAndScales) {
    fit::FitSet set = set_of(random_scene(0));
    const std::vector<float> raw = tensor(set, "gaussians");
    const vk::Buffer exported = upload(context(), std::vector<float>(kCount * 12, 0));
    fit::Rates rates = kRates;
    rates.opacity_weight = 0.01;
    rates.scale_weight = 0.02;
    update(set, rates, 1, 0, exported, 0);
    const std::vector<float> m = tensor(set, "m:gaussians"), now = tensor(set, "gaussians");
    for (std::size_t i = 0; i < m.size(); ++i) {
        const std::size_t k = i % 12;
        ref::FitGaussian gaussian{}, grad{};
        std::copy_n(&raw[i - k], 12, gaussian.begin());
        grad[3] = 0.01 / kCount;
        grad[4] = grad[5] = grad[6] = 0.02 / (3 * kCount);
        const double expected = 0.1 * ref::fit_chain(gaussian, grad)[k];
        EXPECT_NEAR(m[i], expected, 1e-5 * std::abs(expected)) << i;
        const double moved =
            expected > 0 ? rate_of(k) : 0;  // a first step has the length of the rate
        EXPECT_NEAR(now[i], static_cast<double>(raw[i]) - moved, 1e-5) << i;
    }
}

TEST_P(FitSetTest, SkippedZerosLeaveParametersAndMoments) {
    fit::FitSet set = set_of(random_scene(3)), dense = set_of(random_scene(3));
    const vk::Buffer exported = upload(context(), std::vector<float>(kCount * 12, 0));
    fit::Rates rates = kRates;
    rates.skip_zeros = true;
    for (std::uint64_t step = 1; step < 3; ++step) {
        std::vector<float> grads = normal_fill(kCount * 12, step),
                           colors = normal_fill(kCount * 48, 9);
        if (step == 2)  // every third is not seen
            for (std::size_t i = 0; i < kCount; i += 3) {
                std::fill_n(&grads[12 * i], 12, 0.0F);
                std::fill_n(&colors[48 * i], 48, 0.0F);
            }
        const std::vector<float> before = tensor(set, "gaussians"), m = tensor(set, "m:colors");
        for (fit::FitSet* const each : {&set, &dense}) {
            write(each->gradients(3).gaussians, grads);
            write(each->gradients(3).colors, colors);
            update(*each, each == &set ? rates : kRates, step, 3, exported, 0);
        }
        if (step == 1) continue;
        const std::vector<float> now = tensor(set, "gaussians"), whole = tensor(dense, "gaussians"),
                                 now_m = tensor(set, "m:colors"),
                                 whole_m = tensor(dense, "m:colors");
        for (std::size_t i = 0; i < now.size(); ++i)
            EXPECT_EQ(now[i], (i / 12 % 3 == 0 ? before : whole)[i]) << i;
        for (std::size_t i = 0; i < m.size(); ++i)
            EXPECT_EQ(now_m[i], (i / 48 % 3 == 0 ? m : whole_m)[i]) << i;
        EXPECT_NE(before, whole);
    }
}

TEST_P(FitSetTest, StateComesBackBitByBit) {
    fit::FitSet set = set_of(random_scene(3));
    const vk::Buffer exported = upload(context(), normal_fill(kCount * 12, 8));
    write(set.gradients(3).gaussians, normal_fill(kCount * 12, 3));
    update(set, kRates, 1, 3, exported, 1);
    io::NamedTensors state;
    ASSERT_OK(set.save(state));
    fit::FitSet other = need(fit::FitSet::create(context(), kCapacity, 3));
    ASSERT_OK(other.load(state));
    for (const char* name : {"gaussians", "colors", "m:gaussians", "v:gaussians", "m:colors",
                             "v:colors", "statistics"})
        EXPECT_EQ(tensor(set, name), tensor(other, name)) << name;
    EXPECT_EQ(read(set.drawn(3).gaussians, kCount * 12),
              read(other.drawn(3).gaussians, kCount * 12));
    fit::FitSet small = need(fit::FitSet::create(context(), kCount - 1, 3));
    EXPECT_ERROR(small.load(state), Code::kInvalidArgument, "has 77 Gaussians, expected 1 to 76");
    fit::FitSet flat = need(fit::FitSet::create(context(), kCapacity, 0));
    EXPECT_ERROR(flat.load(state), Code::kInvalidArgument,
                 "'colors' of the state has another shape");
    EXPECT_EQ(flat.count(), 0);
}

}  // namespace
}  // namespace splat::test

// splat_optimizer against Adam in float64, its groups, schedules and averages, and its resumption.
#include <cmath>
#include <numbers>

#include "api/api_calls.h"
#include "ref/adam_ref.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

using Doubles = std::vector<double>;

constexpr std::size_t kWeights = 15;
constexpr std::size_t kBiases = 7;

Doubles wide(const Floats& values) {
    return {values.begin(), values.end()};
}

/// Two parameters on the device with their gradients, and an optimizer of them.
struct Fixture {
    Fixture(const Floats& weights, const Floats& biases)
        : weight(upload(shared_device(), {5, 3}, weights)),
          bias(upload(shared_device(), {7}, biases)),
          grad_weight(make_tensor(shared_device(), {5, 3})),
          grad_bias(make_tensor(shared_device(), {7})),
          items{{"layer.weight", nullptr, nullptr, weight, grad_weight},
                {"layer.bias", nullptr, nullptr, bias, grad_bias}} {}

    [[nodiscard]] splat_optimizer_desc desc() const { return optimizer_desc(items, 2); }
    void create(const splat_optimizer_desc& from) {
        ASSERT_DONE(splat_optimizer_create(shared_device(), &from, optimizer.out()));
    }
    /// One step with the gradients of step `number`.
    splat_optimizer_info step(std::size_t number) {
        const Floats first = normal_fill(kWeights, 100 + number, 0, 1e-2F);
        const Floats second = normal_fill(kBiases, 200 + number, 0, 1e-2F);
        write(grad_weight, first);
        write(grad_bias, second);
        return got(splat_optimizer_step, optimizer);
    }
    [[nodiscard]] Weights saved() const { return got(splat_optimizer_save, optimizer); }

    Tensor weight, bias, grad_weight, grad_bias;
    splat_optimizer_item items[2];
    Optimizer optimizer;
};

Floats read(const Weights& weights, const char* name, std::size_t count) {
    Floats values(count);
    const auto index = got(splat_weights_find, weights, name);
    EXPECT_DONE(splat_weights_read(weights, index, values.data(), 4 * count));
    return values;
}

/// The rate is warmed up in 2 steps and then falls by half a cosine up to step 10.
double cosine_rate(std::size_t step) {
    if (step <= 2) return 0.02 * static_cast<double>(step) / 3;
    return 0.01 * (1 + std::cos(std::numbers::pi * static_cast<double>(step - 3) / 8));
}

/// A few roundings of each step, as in tests/ops/adam_test.cpp, and of the value.
double tolerance(double value, std::size_t steps) {
    return static_cast<double>(steps) * (1.2e-7 * std::abs(value) + 2e-6 * 0.02);
}

TEST(ApiOptimizer, MatchesFloat64InGroups) {
    const Floats weights = normal_fill(kWeights, 1);
    const Floats biases = normal_fill(kBiases, 2);
    Fixture fixture(weights, biases);
    splat_optimizer_desc desc = fixture.desc();
    const splat_optimizer_group groups[] = {{"*.bias", 0.1, 0.8, 0.99, 1e-8},
                                            {"layer.*", 0, 0, 0, 1e-12}};
    desc.groups = groups;
    desc.group_count = 2;
    desc.rate = 0.02;
    desc.schedule = SPLAT_SCHEDULE_COSINE;
    desc.warmup_steps = 2;
    desc.total_steps = 10;
    desc.ema_decay = 0.6;
    desc.ema_after = 1;
    fixture.create(desc);
    ref::AdamState first{wide(weights), Doubles(kWeights), Doubles(kWeights)};
    ref::AdamState second{wide(biases), Doubles(kBiases), Doubles(kBiases)};
    Doubles average(kBiases);
    for (std::size_t step = 1; step <= 10; ++step) {
        const double rate = cosine_rate(step);
        const splat_optimizer_info info = fixture.step(step);
        EXPECT_EQ(info.step, step);
        EXPECT_NEAR(info.rate, rate, 1e-15);
        EXPECT_EQ(info.was_skipped, 0U);
        EXPECT_EQ(info.elements, kWeights + kBiases);
        ref::adam_step({.learning_rate = rate, .eps = 1e-12}, step,
                       wide(normal_fill(kWeights, 100 + step, 0, 1e-2F)), first);
        ref::adam_step({.learning_rate = rate * 0.1, .beta1 = 0.8, .beta2 = 0.99, .eps = 1e-8},
                       step, wide(normal_fill(kBiases, 200 + step, 0, 1e-2F)), second);
        // Calls are counted from 0, and the first after ema_after is a copy too.
        const double epoch = static_cast<double>(step) - 2;
        const double decay = step <= 3 ? 0 : std::min(0.6, 1 - std::pow(1 + epoch, -2.0 / 3));
        for (std::size_t i = 0; i < kBiases; ++i)
            average[i] = decay * average[i] + (1 - decay) * second.value[i];
    }
    const Floats got_weights = download(fixture.weight);
    const Floats got_biases = download(fixture.bias);
    for (std::size_t i = 0; i < kWeights; ++i)
        EXPECT_NEAR(got_weights[i], first.value[i], tolerance(first.value[i], 10)) << i;
    const Weights stored = got(splat_optimizer_store, fixture.optimizer);
    const Floats got_average = read(stored, "layer.bias", kBiases);
    for (std::size_t i = 0; i < kBiases; ++i) {
        EXPECT_NEAR(got_biases[i], second.value[i], tolerance(second.value[i], 10)) << i;
        EXPECT_NEAR(got_average[i], average[i], 2 * tolerance(average[i], 10)) << i;
    }
}

/// Saved to a file in the middle, and resumed with other tensors: the same bits.
TEST(ApiOptimizer, ResumesBitForBit) {
    const auto configure = [](Fixture& fixture) {
        splat_optimizer_desc desc = fixture.desc();
        desc.schedule = SPLAT_SCHEDULE_STEP;
        desc.step_at = 5;
        desc.rate = 1e-2;
        desc.ema_decay = 0.9;
        fixture.create(desc);
    };
    Fixture whole(normal_fill(kWeights, 1), normal_fill(kBiases, 2));
    configure(whole);
    for (std::size_t step = 1; step <= 3; ++step) whole.step(step);
    ASSERT_DONE(splat_optimizer_set_rate(whole.optimizer, 3e-3));
    Fixture resumed(download(whole.weight), download(whole.bias));
    configure(resumed);
    const Temporary path(".safetensors");
    ASSERT_DONE(splat_weights_save(whole.saved(), path.c_str(), 0));
    Weights loaded = got(splat_weights_load, path.c_str(), 0);
    ASSERT_DONE(splat_optimizer_load(resumed.optimizer, loaded));
    loaded.destroy();
    for (std::size_t step = 4; step <= 7; ++step) {
        const splat_optimizer_info expected = whole.step(step);
        const splat_optimizer_info info = resumed.step(step);
        EXPECT_EQ(info.step, expected.step);
        EXPECT_EQ(info.rate, expected.rate);
        EXPECT_EQ(info.rate, step < 5 ? 3e-3 : 3e-3 / 10);
    }
    EXPECT_EQ(download(resumed.weight), download(whole.weight));
    EXPECT_EQ(download(resumed.bias), download(whole.bias));
    for (const char* name : {"m:layer.bias", "v:layer.bias", "ema:layer.bias"})
        EXPECT_EQ(read(resumed.saved(), name, kBiases), read(whole.saved(), name, kBiases)) << name;
}

TEST(ApiOptimizer, RefusesStatesOfOthers) {
    Fixture plain(normal_fill(kWeights, 1), normal_fill(kBiases, 2));
    plain.create(plain.desc());
    Fixture averaged(normal_fill(kWeights, 1), normal_fill(kBiases, 2));
    splat_optimizer_desc desc = averaged.desc();
    desc.ema_decay = 0.9;
    averaged.create(desc);
    plain.step(1);
    const Weights state = plain.saved();
    const Weights averages = averaged.saved();
    EXPECT_REFUSED(splat_optimizer_load(averaged.optimizer, state), kArgument,
                   "'ema:layer.weight' is missing");
    EXPECT_REFUSED(splat_optimizer_load(plain.optimizer, averages), kArgument,
                   "6 tensors, expected 4");
    EXPECT_REFUSED(splat_optimizer_load(plain.optimizer, make_weights()), kArgument,
                   "the weights are no state");
    const auto info = got(splat_optimizer_get_info, plain.optimizer);
    EXPECT_EQ(info.step, 1U) << "unchanged";
}

TEST(ApiOptimizer, SkipsWhatIsNotFinite) {
    Fixture fixture(normal_fill(kWeights, 1), normal_fill(kBiases, 2));
    fixture.create(fixture.desc());
    fixture.step(1);
    const Floats before = download(fixture.weight);
    const Floats broken = {0, NAN, 0, INFINITY, 0, 0, 0};
    write(fixture.grad_bias, broken);
    auto info = got(splat_optimizer_step, fixture.optimizer);
    EXPECT_EQ(info.was_skipped, 1U);
    EXPECT_EQ(info.non_finite, 2U);
    EXPECT_EQ(info.step, 1U);
    EXPECT_EQ(info.skipped, 1U);
    EXPECT_EQ(download(fixture.weight), before);
    ASSERT_DONE(splat_optimizer_zero_gradients(fixture.optimizer));
    EXPECT_EQ(download(fixture.grad_weight), Floats(kWeights));
    ASSERT_DONE(splat_optimizer_step(fixture.optimizer, &info));
    EXPECT_EQ(info.gradients_zero, 1U) << "a step that teaches nothing";
    EXPECT_EQ(info.step, 2U);
    mapped(fixture.bias, SPLAT_ACCESS_READ);
    EXPECT_REFUSED(splat_optimizer_step(fixture.optimizer, nullptr), kState, "is mapped");
}

/// The parameters of a module are updated in place, and its next pass sees them.
TEST(ApiOptimizer, UpdatesModules) {
    const splat_port ports[] = {port_desc({2, 4}, "x"), port_desc({3, 4}, "weight"),
                                port_desc({3}, "bias")};
    auto module_desc = sized<splat_module_desc>();
    module_desc.type = "linear";
    module_desc.flags = SPLAT_MODULE_GRADIENTS;
    module_desc.ports = ports;
    module_desc.port_count = 3;
    Module module = got(splat_module_create, shared_device(), &module_desc);
    ASSERT_DONE(splat_module_init(module, 4));
    const Floats x = normal_fill(8, 3);
    const Floats ones(6, 1);
    ASSERT_DONE(splat_module_write(module, "x", x.data(), 32));
    ASSERT_DONE(splat_module_write(module, "grad:y", ones.data(), 24));
    const splat_optimizer_item item = {"head.", nullptr, module, nullptr, nullptr};
    splat_optimizer_desc desc = optimizer_desc(&item);
    desc.rate = 1e-2;
    const Optimizer optimizer = got(splat_optimizer_create, shared_device(), &desc);
    const auto sum = [&] {
        EXPECT_DONE(splat_module_forward(module));
        double total = 0;
        for (const float value : floats_of(6, splat_module_read, module, "y"))
            total += static_cast<double>(value);
        return total;
    };
    double last = sum();
    for (int step = 0; step < 5; ++step) {
        ASSERT_DONE(splat_optimizer_zero_gradients(optimizer));
        ASSERT_DONE(splat_module_backward(module));
        ASSERT_DONE(splat_optimizer_step(optimizer, nullptr));
        const double next = sum();
        EXPECT_LT(next, last) << "the loss is the sum of the outputs";
        last = next;
    }
    const Weights stored = got(splat_optimizer_store, optimizer);
    EXPECT_EQ(read(stored, "head.bias", 3), floats_of(3, splat_module_read, module, "bias"))
        << "without averages the current ones";
    module.destroy();
    EXPECT_DONE(splat_optimizer_step(optimizer, nullptr)) << "it keeps the module alive";
}

TEST(ApiOptimizer, RefusesWhatHasNoEffect) {
    Fixture fixture(normal_fill(kWeights, 1), normal_fill(kBiases, 2));
    Output<splat_optimizer> out;
    const auto refuse = [&](const splat_optimizer_desc& desc, const char* part) {
        EXPECT_REFUSED(splat_optimizer_create(shared_device(), &desc, out.out()), kArgument, part);
        EXPECT_TRUE(out.untouched());
    };
    const auto grouped = [&](const std::vector<splat_optimizer_group>& groups, const char* part) {
        splat_optimizer_desc desc = fixture.desc();
        desc.groups = groups.data();
        desc.group_count = groups.size();
        refuse(desc, part);
    };
    grouped({{"decoder.*", 0.1, 0, 0, 0}},
            "'decoder.*' of group 0 matches none of the 2 parameters");
    grouped({{"layer*", 0.1, 0, 0, 0}, {"*.bias", 2, 0, 0, 0}}, "groups before it have all");
    grouped({{"*.bias", 0, 0, 0, 0}}, "sets neither a rate, betas nor eps");
    grouped({{"*.bias", -1, 0, 0, 0}}, "groups[0].rate_factor is -1");
    grouped({{"*.bias", 0, 1, 0, 0}}, "betas");
    splat_optimizer_desc desc = fixture.desc();
    const splat_optimizer_group kept[] = {{"*.bi?s", 0, 0, 0, 0}, {"*", 0.1, 0, 0, 0}};
    desc.groups = kept;
    desc.group_count = 2;
    Optimizer made;
    EXPECT_DONE(splat_optimizer_create(shared_device(), &desc, made.out()))
        << "a group without numbers keeps its parameters from the next";
    fixture.items[1].name = "layer.weight";
    refuse(fixture.desc(), "two parameters are named 'layer.weight'");
    fixture.items[1] = fixture.items[0];
    fixture.items[1].name = "again";
    refuse(fixture.desc(), "are the same parameter");
    const Model frozen = make_model(shared_device());
    fixture.items[1] = {nullptr, frozen, nullptr, nullptr, nullptr};
    splat_optimizer_desc without = fixture.desc();
    EXPECT_REFUSED(splat_optimizer_create(shared_device(), &without, out.out()), kState,
                   "items[1].model was created without SPLAT_MODEL_GRADIENTS");
    const Module module = make_module(open_device());  // another device
    fixture.items[1] = {nullptr, nullptr, module, nullptr, nullptr};
    refuse(fixture.desc(), "items[1].module is on another device");
    const splat_port ports[] = {port_desc({2, 4}, "x"), port_desc({3, 4}, "weight")};
    auto module_of = sized<splat_module_desc>();
    module_of.type = "linear";
    module_of.ports = ports;
    module_of.port_count = 2;
    const Module linear = got(splat_module_create, shared_device(), &module_of);
    fixture.items[1] = {nullptr, nullptr, linear, nullptr, nullptr};
    without = fixture.desc();
    EXPECT_REFUSED(splat_optimizer_create(shared_device(), &without, out.out()), kState,
                   "items[1].module was created without SPLAT_MODULE_GRADIENTS");
}

}  // namespace
}  // namespace splat::test

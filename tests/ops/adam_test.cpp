#include "ops/adam.h"

#include <gtest/gtest.h>

#include "ops/op_harness.h"
#include "ref/adam_ref.h"
#include "support/golden_file.h"
#include "support/gpu_buffers.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

class Adam : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(Adam);

/// A block on the device, its moments, and one recorded step that is run again and again.
class Optimiser {
  public:
    Optimiser(vk::Context& context, std::vector<float> value, double rate)
        : context_(context), elements_(value.size()), rate_(rate) {
        value.resize((value.size() + 3) / 4 * 4, 7);
        const std::vector<float> zeros(value.size(), 0);
        value_ = upload(context, value);
        grad_ = upload(context, zeros);
        m_ = upload(context, zeros);
        v_ = upload(context, zeros);
        vk::Recorder recorder(context);
        // Behind those of another rule, which nothing may read.
        scalars_ = upload(context, std::vector<float>(16, NAN));
        EXPECT_OK(ops::adam(recorder, {scalars_.range(), 1}, value_.range(), grad_.range(),
                            m_.range(), v_.range()));
        list_ = std::move(recorder.finish().value());
    }

    void step(std::vector<float> grad, std::uint64_t number) {
        grad.resize((grad.size() + 3) / 4 * 4, 0);
        const vk::Buffer from = upload(context_, grad);
        vk::Recorder recorder(context_);
        EXPECT_OK(recorder.copy(from.range(), grad_.range()));
        vk::CommandList copy = std::move(recorder.finish().value());
        EXPECT_OK(context_.run(copy));
        const auto scalars = need(ops::adam_scalars({.step = number, .learning_rate = rate_}));
        EXPECT_OK(context_.write(scalars_.range().part(32, 32), scalars.data(), sizeof scalars));
        EXPECT_OK(context_.run(list_));
    }

    std::vector<float> value() { return download(context_, value_.range(), elements_); }
    std::vector<float> m() { return download(context_, m_.range(), elements_); }
    std::vector<float> v() { return download(context_, v_.range(), elements_); }
    std::vector<float> padded() { return download(context_, value_.range(), value_.bytes() / 4); }

  private:
    vk::Context& context_;
    std::size_t elements_;
    double rate_;
    vk::Buffer value_;
    vk::Buffer grad_;
    vk::Buffer m_;
    vk::Buffer v_;
    vk::Buffer scalars_;
    vk::CommandList list_;
};

/// A step moves a value by up to its rate, of which some 1e-6 is rounding; then the value is rounded.
double allowed(double value, double rate, std::size_t steps) {
    return static_cast<double>(steps) * (1.2e-7 * std::abs(value) + 2e-6 * rate);
}

TEST_P(Adam, MatchesFloat64) {
    constexpr double kRate = 0.02;
    constexpr std::size_t kSteps = 5;
    for (const std::size_t elements : {1U, 3U, 4U, 5U, 255U, 1030U}) {
        const std::vector<float> start = normal_fill(elements, elements);
        Optimiser gpu(context(), start, kRate);
        const std::vector<double> zeros(elements, 0);
        ref::AdamState reference{to_double(start), zeros, zeros};
        for (std::size_t step = 1; step <= kSteps; ++step) {
            std::vector<float> grad = normal_fill(elements, 100 * step, 0, step == 3 ? 1e-8 : 1e-3);
            if (step < 3) grad[elements / 2] = 0;
            gpu.step(grad, step);
            ref::adam_step({.learning_rate = kRate}, step, to_double(grad), reference);
        }
        const std::vector<float> value = gpu.value();
        const std::vector<float> m = gpu.m();
        const std::vector<float> v = gpu.v();
        for (std::size_t i = 0; i < elements; ++i) {
            EXPECT_NEAR(value[i], reference.value[i], allowed(reference.value[i], kRate, kSteps))
                << i;
            EXPECT_NEAR(m[i], reference.m[i], 1e-9) << i;   // moments go up to 1e-3
            EXPECT_NEAR(v[i], reference.v[i], 1e-14) << i;  // these go up to 1e-8
        }
        for (std::size_t i = elements; i < gpu.padded().size(); ++i) EXPECT_EQ(gpu.padded()[i], 7);
    }
}

TEST_P(Adam, WithoutAGradientNothingMoves) {
    const std::vector<float> start = normal_fill(9, 3);
    Optimiser gpu(context(), start, 1);
    for (std::uint64_t step = 1; step < 4; ++step) gpu.step(std::vector<float>(9, 0), step);
    EXPECT_EQ(gpu.value(), start);
}

/// The first step has the length of the rate, whatever the size of the gradient.
TEST_P(Adam, FirstStepIsTheRate) {
    Optimiser gpu(context(), {1, 1, 1, 1, 1}, 0.25);
    gpu.step({1e-8F, -1e-4F, 3, -1e6F, 0}, 1);
    const float expected[] = {0.75F, 1.25F, 0.75F, 1.25F, 1};
    for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(gpu.value()[i], expected[i], 1e-6) << i;
}

/// A step that is marked as skipped leaves values and moments, whatever the gradients are.
TEST_P(Adam, ASkippedStepChangesNothing) {
    for (const bool skipped : {true, false}) {
        const std::vector<float> start = normal_fill(8, 3);
        const vk::Buffer value = upload(context(), start), m = upload(context(), start),
                         v = upload(context(), std::vector<float>(8, 1));
        const vk::Buffer grad = upload(context(), std::vector<float>(8, NAN));
        auto scalars = need(ops::adam_scalars({}));
        scalars.back() = skipped ? 1 : 0;
        const vk::Buffer numbers =
            upload(context(), std::vector<float>(scalars.begin(), scalars.end()));
        vk::Recorder recorder(context());
        EXPECT_OK(ops::adam(recorder, {numbers.range()}, value.range(), grad.range(), m.range(),
                            v.range()));
        vk::CommandList list = std::move(recorder.finish().value());
        EXPECT_OK(context().run(list));
        EXPECT_EQ(download(context(), value.range(), 8) == start, skipped);
        EXPECT_EQ(download(context(), m.range(), 8) == start, skipped);
        EXPECT_EQ(download(context(), v.range(), 8) == std::vector<float>(8, 1), skipped);
    }
}

TEST_P(Adam, GoldenNet) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    each_golden("train", [&](const Golden& golden) {
        const std::vector<float> grads = golden.floats("adam.g");
        const std::vector<double> expected = golden.doubles("adam.p");
        const std::vector<float> start = golden.floats("adam.p0");
        const double rate = golden.doubles("adam.lr").at(0);
        const auto elements = static_cast<std::ptrdiff_t>(start.size());
        Optimiser gpu(context(), start, rate);
        for (std::ptrdiff_t step = 0; step < std::ssize(grads) / elements; ++step) {
            gpu.step({grads.begin() + step * elements, grads.begin() + (step + 1) * elements},
                     static_cast<std::uint64_t>(step + 1));
            const std::vector<float> value = gpu.value();
            for (std::ptrdiff_t i = 0; i < elements; ++i) {
                const double wanted = expected[static_cast<std::size_t>(step * elements + i)];
                // Both sides are float32.
                EXPECT_NEAR(value[static_cast<std::size_t>(i)], wanted,
                            2 * allowed(wanted, rate, static_cast<std::size_t>(step + 1)))
                    << golden.name << " step " << step << " element " << i;
            }
        }
    });
}

TEST_P(Adam, RefusesBadNumbers) {
    EXPECT_OK(ops::adam_check({}));
    EXPECT_ERROR(ops::adam_check({.step = 0}), Code::kInvalidArgument, "step is 0");
    EXPECT_ERROR(ops::adam_check({.learning_rate = -1}), Code::kInvalidArgument, "rate is -1");
    EXPECT_ERROR(ops::adam_check({.beta1 = 1}), Code::kInvalidArgument, "betas");
    EXPECT_ERROR(ops::adam_check({.beta2 = -0.5}), Code::kInvalidArgument, "betas");
    EXPECT_ERROR(ops::adam_check({.eps = 0}), Code::kInvalidArgument, "eps is 0");
    EXPECT_ERROR(ops::adam_scalars({.step = 0}).status(), Code::kInvalidArgument, "step is 0");
    const vk::Buffer block = device_buffer(context(), 8);
    const vk::Buffer other = device_buffer(context(), 4);
    vk::Recorder recorder(context());
    EXPECT_ERROR(ops::adam(recorder, {block.range()}, block.range(), other.range(), block.range(),
                           block.range()),
                 Code::kShape, "32, 16, 32 and 32 bytes");
    EXPECT_TRUE(recorder.finish().value().empty()) << "nothing is recorded on error";
}

}  // namespace
}  // namespace splat::test

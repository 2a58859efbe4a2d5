#include "ops/losses/ssim.h"

#include <gtest/gtest.h>

#include <cmath>
#include <iterator>

#include "ops/op_harness.h"
#include "ref/losses/ssim_ref.h"
#include "support/golden_file.h"

namespace splat::test {
namespace {

/// ||got - expected|| / ||expected||
double ssim_gradient_error(const std::vector<float>& got, const std::vector<double>& expected) {
    double error = 0;
    double norm = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
        const double difference = static_cast<double>(got[i]) - expected[i];
        error += difference * difference;
        norm += expected[i] * expected[i];
    }
    return std::sqrt(error / norm);
}

class Ssim : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(Ssim);

OpCall ssim_call(const HostTensor& a, const HostTensor& b, float grad_loss) {
    return sample("ssim", Json::object(), {a, b}, std::vector<HostTensor>{{{1}, {grad_loss}}});
}

/// Images of 0 to 1: a ramp with noise, so that neighbours are alike.
HostTensor image(const Shape& shape, std::uint64_t seed) {
    HostTensor tensor{shape, {}};
    Rng rng(seed);
    const std::uint64_t elements = shape.elements();
    for (std::uint64_t i = 0; i < elements; ++i)
        tensor.values.push_back(static_cast<float>(
            0.5 * rng.uniform() + 0.5 * static_cast<double>(i) / static_cast<double>(elements)));
    return tensor;
}

ref::SsimInput ssim_reference(const OpCall& call) {
    const Shape& a = call.inputs[0].shape;
    return {std::size_t{a[0]} * a[1], a[2], a[3], to_double(call.inputs[0].values),
            to_double(call.inputs[1].values)};
}

/// Smaller than the window, as wide as it, lines, ends of chunks, channels that pad a quad, batches.
constexpr std::uint32_t kSsimShapes[][4] = {
    {1, 1, 1, 1},   {1, 2, 3, 4},   {2, 3, 11, 11}, {1, 4, 1, 40},  {1, 5, 37, 1},  {3, 3, 21, 17},
    {1, 3, 32, 32}, {1, 3, 25, 41}, {1, 1, 5, 5},   {2, 1, 6, 10},  {1, 8, 7, 9},   {3, 4, 2, 2},
    {1, 3, 15, 17}, {2, 3, 16, 16}, {1, 3, 17, 33}, {1, 1, 10, 12}, {1, 1, 12, 10}, {1, 9, 8, 3},
    {1, 2, 31, 33}, {1, 1, 64, 65}, {2, 2, 1, 65},  {1, 1, 129, 5}, {1, 1, 3, 257}, {1, 17, 4, 5},
};
static_assert(std::size(kSsimShapes) >= 24);

TEST_P(Ssim, MatchesFloat64) {
    std::uint64_t seed = 10;
    for (const auto& [n, c, h, w] : kSsimShapes) {
        const Shape shape{n, c, h, w};
        seed += 2;
        const OpCall call = ssim_call(image(shape, seed), image(shape, seed + 1), 1.5F);
        expect_float64(context(), call, shape.text());
    }
}

TEST_P(Ssim, EqualImagesGiveOne) {
    const HostTensor a = image({2, 3, 20, 30}, 40);
    const OpResult gpu = run_op(context(), ssim_call(a, a, 1));
    ASSERT_OK(gpu.status);
    EXPECT_NEAR(gpu.outputs[0][0], 1, 1e-6);
    for (const float gradient : gpu.grad_inputs[0]) EXPECT_NEAR(gradient, 0, 1e-6);
}

/// Flat and nearly equal: the variances are differences of numbers near `level`^2, against C2 = 9e-4.
TEST_P(Ssim, IsAtMostOne) {
    const Shape shape{1, 3, 33, 40};
    for (const double level : {0.0, 0.25, 0.98, 1.0})
        for (const double noise : {1e-5, 1e-4, 1e-3}) {
            HostTensor a{shape, normal_fill(shape.elements(), 70, level, 1e-3)};
            HostTensor b = a;
            const std::vector<float> change = normal_fill(shape.elements(), 71, 0, noise);
            for (std::size_t i = 0; i < b.values.size(); ++i) b.values[i] += change[i];
            const OpCall call = ssim_call(a, b, 1);
            const OpResult gpu = run_op(context(), call);
            ASSERT_OK(gpu.status);
            const ref::SsimInput in = ssim_reference(call);
            SCOPED_TRACE("level " + std::to_string(level) + " noise " + std::to_string(noise));
            EXPECT_LE(gpu.outputs[0][0], 1);
            EXPECT_NEAR(static_cast<double>(gpu.outputs[0][0]), ref::ssim_forward<double>(in)[0],
                        1e-6);
            const std::vector<double> expected = ref::ssim_backward<double>(in, 1);
            EXPECT_LE(ssim_gradient_error(gpu.grad_inputs[0], expected), 2e-3);
        }
}

TEST_P(Ssim, IsTheMeanOverImages) {
    const Shape one{1, 3, 20, 30};
    const OpCall first = ssim_call(image(one, 50), image(one, 51), 1);
    const OpCall second = ssim_call(image(one, 52), image(one, 53), 1);
    OpCall both = first;
    for (std::size_t i = 0; i < 2; ++i) {
        both.inputs[i].shape = {2, 3, 20, 30};
        both.inputs[i].values.insert(both.inputs[i].values.end(), second.inputs[i].values.begin(),
                                     second.inputs[i].values.end());
    }
    const OpResult results[] = {run_op(context(), first), run_op(context(), second),
                                run_op(context(), both)};
    for (const OpResult& result : results) ASSERT_OK(result.status);
    EXPECT_NEAR(results[2].outputs[0][0], (results[0].outputs[0][0] + results[1].outputs[0][0]) / 2,
                1e-6);
    for (std::size_t i = 0; i < one.elements(); ++i)
        ASSERT_NEAR(results[2].grad_inputs[0][i], results[0].grad_inputs[0][i] / 2, 1e-8) << i;
}

/// Flat regions: a variance there is the difference of two numbers near 1, against C2 = 9e-4, so that a
/// rounding of 6e-8 becomes 7e-5 of S; 1e-5 where such pixels are a share of the image.
constexpr double kGoldenSsim = 1e-5;

TEST_P(Ssim, GoldenNet) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    each_golden("metric", [&](const Golden& golden) {
        const std::vector<std::string> pairs = golden.cases("a");
        golden.expect_cases(pairs, {"0", "1", "2"});
        for (const std::string& pair : pairs) {
            const auto name = [&pair](const char* key) { return pair + "." + key; };
            const OpResult gpu =
                run_op(context(), ssim_call(image_batch(golden_tensor(golden.npz, name("a"))),
                                            image_batch(golden_tensor(golden.npz, name("b"))), 1));
            ASSERT_OK(gpu.status);
            const std::string how = reproduce(name(golden.name.c_str()));
            EXPECT_TRUE(close(gpu.outputs[0], golden.doubles(name("ssim64")), kGoldenSsim, 0,
                              {"loss", how}));
            const std::vector<double> expected = golden.doubles(name("d_ssim64"));
            EXPECT_LE(ssim_gradient_error(gpu.grad_inputs[0], expected), 1e-4) << how;
        }
    });
}

TEST_P(Ssim, RejectsBadShapes) {
    const auto status = [this](const Shape& a, const Shape& b) {
        return run_op(context(), ssim_call(normal_tensor(a, 1), normal_tensor(b, 2), 1)).status;
    };
    EXPECT_ERROR(status({1, 3, 4, 5}, {1, 3, 5, 4}), Code::kShape, "'b'");
    EXPECT_ERROR(status({1, 3, 20}, {1, 3, 20}), Code::kShape, "[N, C, H, W]");
}

TEST(SsimReference, GradcheckFloat64) {
    for (const Shape& shape : {Shape{1, 1, 2, 3}, Shape{1, 2, 9, 13}}) {
        const ref::SsimInput in = ssim_reference(ssim_call(image(shape, 60), image(shape, 61), 1));
        expect_gradcheck({in.a},
                         [&in](const Arrays& inputs) {
                             ref::SsimInput changed = in;
                             changed.a = inputs[0];
                             return Arrays{ref::ssim_forward<double>(changed)};
                         },
                         {{1.5}}, {ref::ssim_backward<double>(in, 1.5)});
    }
}

}  // namespace
}  // namespace splat::test

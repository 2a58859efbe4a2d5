#include "ops/tensor_stats.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "ref/tensor_stats_ref.h"
#include "support/compare.h"
#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "support/rng_fill.h"
#include "support/shapes.h"

namespace splat::test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kMost = std::numeric_limits<float>::max();

ops::TensorStats measure(vk::Context& context, const std::vector<float>& x) {
    const vk::Buffer in = upload(context, x);
    const std::size_t words = ops::tensor_stats_partial_bytes(x.size()) / 4;
    const vk::Buffer partial = device_buffer(context, words);
    vk::Recorder r(context);
    EXPECT_OK(ops::tensor_stats(r, x.size(), in.range(), partial.range()));
    vk::CommandList list = std::move(r.finish().value());
    EXPECT_OK(context.run(list));
    return ops::tensor_stats_merge(download_words(context, partial.range(), words));
}

void expect_stats(const std::vector<float>& x, const std::string& what) {
    vk::Context* context = shared_context();
    ASSERT_NE(context, nullptr);
    const ops::TensorStats gpu = measure(*context, x);
    const ref::TensorStats expected = ref::tensor_stats(x);
    const std::string how = reproduce(what);
    EXPECT_EQ(gpu.nan_count, expected.nan_count) << how;
    EXPECT_EQ(gpu.inf_count, expected.inf_count) << how;
    EXPECT_EQ(gpu.min, expected.min) << how;
    EXPECT_EQ(gpu.max, expected.max) << how;
    const double allowed =
        bound(tolerance("tensor_stats", "mean").c, x.size(), expected.mean_magnitude);
    EXPECT_LE(std::abs(gpu.mean - expected.mean), allowed) << how;
}

TEST(TensorStats, MatchesFloat64) {
    std::uint64_t seed = 1;
    for (const std::uint32_t size : kOddSizes)
        expect_stats(normal_fill(size, ++seed), "size " + std::to_string(size));
    for (const std::size_t size : {16383U, 16384U, 16385U, 65537U, 1000003U})
        expect_stats(normal_fill(size, ++seed, 3, 2), "size " + std::to_string(size));
}

TEST(TensorStats, CountsNaNAndInfinityAnywhere) {
    Rng rng(5);
    for (const std::size_t size : {1U, 5U, 64U, 1000U, 40000U}) {
        std::vector<float> x = normal_fill(size, size);
        for (std::size_t i = 0; i < 1 + size / 10; ++i) {
            x[rng.below(size)] = kNan;
            x[rng.below(size)] = kInf;
            x[rng.below(size)] = -kInf;
        }
        x.back() = -kNan;
        expect_stats(x, "size " + std::to_string(size));
    }
}

TEST(TensorStats, NothingFinite) {
    expect_stats({kNan, kNan, kInf}, "nothing finite");
    const ops::TensorStats stats = measure(*shared_context(), std::vector<float>(20000, kNan));
    EXPECT_EQ(stats.nan_count, 20000U);
    EXPECT_EQ(stats.min, std::numeric_limits<double>::infinity());
    EXPECT_EQ(stats.max, -std::numeric_limits<double>::infinity());
    EXPECT_EQ(stats.mean, 0);
}

TEST(TensorStats, ExtremesDoNotOverflow) {
    expect_stats({kMost, kMost, kMost, kMost}, "largest");
    expect_stats({kMost, -kMost, kMost, -kMost, 1.0F}, "both signs");
    expect_stats(std::vector<float>(20000, -kMost), "largest, many");
    expect_stats({1e-30F, -1e-30F, 0.0F, -0.0F}, "small");
}

TEST(TensorStats, LargeMeanAndOneOutlier) {
    expect_stats(normal_fill(100000, 7, 1e6, 1), "mean 1e6");
    std::vector<float> x(50000, 1.0F);
    x[49999] = -5;
    x[12345] = 7;
    expect_stats(x, "outliers");
}

TEST(TensorStats, BitEqualOverPoison) {
    const std::vector<float> x = normal_fill(30001, 8);
    std::vector<double> means;
    for (const std::uint32_t pattern : kPoisonPatterns) {
        vk::ContextDesc desc = context_desc();
        desc.memory.poison = pattern;
        const auto context = make_context(desc);
        ASSERT_NE(context, nullptr);
        means.push_back(measure(*context, x).mean);
    }
    EXPECT_EQ(means[0], means[1]);
    EXPECT_EQ(means[0], means[2]);
}

}  // namespace
}  // namespace splat::test

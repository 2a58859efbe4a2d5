// How vkrun stress judges results of denormal inputs, which devices may flush to zero.
#include <gtest/gtest.h>

#include <cmath>

#include "stress/op_bound.h"

namespace vkrun::stress {
namespace {

using splat::ref::Summed;

constexpr float kDenormal = 1e-40F;
constexpr float kSmallestNormal = 0x1p-126F;

/// y = x, and gradients of relu: 2 where x > 0.
OpCase relu_case(const std::vector<float>& x) {
    OpCase op_case;
    op_case.op = "relu";
    op_case.attributes = Json::object();
    const auto size = static_cast<std::int64_t>(x.size());
    op_case.inputs = {{"x", {size}, x}};
    op_case.outputs = {{"y", {size}, std::vector<float>(x.size(), 2)}};
    return op_case;
}

Summed<double> slopes(const OpCase& op_case) {
    const std::vector<float>& x = op_case.inputs[0].values;
    Summed<double> sums(x.size(), 1);
    for (std::size_t i = 0; i < x.size(); ++i) sums.add(i, x[i] > 0 ? 2 : 0);
    return sums;
}

Expected expected_slopes(const std::vector<float>& x) {
    const OpCase op_case = relu_case(x);
    const OpCase zeroed = with_denormals_zeroed(op_case);
    const Summed<double> flushed = slopes(zeroed);
    return expected_op(op_case, slopes(op_case),
                       has_other_values(zeroed, op_case) ? &flushed : nullptr);
}

TEST(StressBound, AFlushedInputMayGiveTheResultOfZero) {
    const Expected expected = expected_slopes({kDenormal, 1, kDenormal});
    EXPECT_TRUE(judge({2, 2, 2}, expected).passed());
    EXPECT_TRUE(judge({0, 2, 0}, expected).passed());
    EXPECT_EQ(judge({0, 2, 0}, expected).error, 0);
    EXPECT_EQ(judge({1, 2, 0}, expected).wrong, 1U) << "between the two";
    EXPECT_EQ(judge({0, 0, 0}, expected).wrong, 1U) << "of a normal input";
    EXPECT_EQ(judge({2.001F, 2, -0.001F}, expected).wrong, 2U);
    EXPECT_EQ(judge({0, 2, std::nanf("")}, expected).non_finite, 1U);
}

TEST(StressBound, NormalInputsHaveOneResult) {
    const Expected expected = expected_slopes({kSmallestNormal, -1, 0});
    EXPECT_TRUE(expected.other.empty());
    EXPECT_TRUE(judge({2, 0, 0}, expected).passed());
    EXPECT_EQ(judge({0, 0, 0}, expected).wrong, 1U);
}

TEST(StressBound, ZeroesDenormalsAlone) {
    OpCase op_case = relu_case({kDenormal, -kDenormal, kSmallestNormal, -3, 0});
    op_case.outputs[0].values[1] = -kDenormal;
    const OpCase zeroed = with_denormals_zeroed(op_case);
    EXPECT_EQ(zeroed.inputs[0].values, (std::vector<float>{0, 0, kSmallestNormal, -3, 0}));
    EXPECT_TRUE(std::signbit(zeroed.inputs[0].values[1]));
    EXPECT_EQ(zeroed.outputs[0].values, (std::vector<float>{2, 0, 2, 2, 2}));
    EXPECT_TRUE(has_other_values(zeroed, op_case));
    EXPECT_FALSE(has_other_values(zeroed, zeroed));
}

TEST(StressBound, PlantedErrorsLieBeyondBoth) {
    for (const std::vector<float>& x : {std::vector<float>{kDenormal, 1}, {1, 1}}) {
        const Expected expected = expected_slopes(x);
        EXPECT_EQ(judge({beyond_bound(expected), 2}, expected).wrong, 1U);
    }
    Expected expected = expected_slopes({kDenormal, 1});
    expected.other[0] = 2.002;  // where the planted error would be if it knew one result only
    EXPECT_EQ(judge({beyond_bound(expected), 2}, expected).wrong, 1U);
}

}  // namespace
}  // namespace vkrun::stress

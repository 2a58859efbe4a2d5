#include "ops/images/pad2d.h"

#include <gtest/gtest.h>

#include "ops/op_harness.h"

namespace splat::test {
namespace {

class Pad2d : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(Pad2d);

struct PadCase {
    Shape x;
    int left, right, top, bottom;
    bool replicate;

    [[nodiscard]] OpCall call(std::uint64_t seed) const {
        const auto size = [](std::uint32_t from, int more) {
            return static_cast<std::uint32_t>(static_cast<int>(from) + more);
        };
        return sample("pad2d",
                      {{"left", left},
                       {"right", right},
                       {"top", top},
                       {"bottom", bottom},
                       {"replicate", replicate}},
                      {normal_tensor(x, seed)},
                      {Shape{x[0], x[1], size(x[2], top + bottom), size(x[3], left + right)}});
    }
    [[nodiscard]] std::string text() const {
        return x.text() + format(" by %d %d %d %d", left, right, top, bottom) +
               (replicate ? " replicate" : "");
    }
};

TEST_P(Pad2d, MatchesFloat64) {
    const PadCase cases[] = {
        {{1, 1, 1, 1}, 1, 1, 1, 1, false},      {{1, 1, 1, 1}, 3, 2, 1, 4, false},
        {{2, 3, 4, 5}, 1, 1, 1, 1, false},      {{2, 3, 4, 5}, 0, 0, 0, 0, false},
        {{1, 4, 3, 3}, 0, 2, 3, 0, false},      {{2, 6, 9, 7}, -1, -1, -1, -1, false},
        {{2, 6, 9, 7}, -3, 2, 4, -5, false},    {{1, 5, 2, 9}, 2, -3, -1, 2, false},
        {{1, 5, 2, 9}, -8, 4, 0, 0, false},     {{3, 7, 1, 17}, 1, 1, 2, 2, false},
        {{1, 65, 2, 2}, 64, 64, 64, 64, false}, {{1, 3, 33, 31}, 7, 0, 0, 9, false},
    };
    std::uint64_t seed = 10;
    for (PadCase c : cases)
        for (const bool replicate : {false, true}) {
            c.replicate = replicate;
            const OpCall call = c.call(++seed);
            const OpExpected expected = expected_of(call);
            const OpResult gpu = run_op(context(), call);
            ASSERT_OK(gpu.status) << c.text();
            const std::string how = reproduce(c.text());  // many results are zero
            EXPECT_TRUE(exact(gpu.outputs[0], expected.outputs[0], {"y", how, false, true}));
            EXPECT_TRUE(matches(gpu.grad_inputs[0], expected.grad_inputs[0],
                                tolerance("pad2d", "grad_x"), {"grad_x", how, true, true}));
        }
}

/// Sums of whole numbers are exact.
TEST_P(Pad2d, IntegersAreExact) {
    for (const bool replicate : {false, true}) {
        const PadCase c{{2, 6, 3, 4}, 3, 1, 2, 5, replicate};
        expect_exact(context(), with_integers(c.call(3), 4), c.text(), true);
    }
}

TEST_P(Pad2d, GivesEachCopyBackToItsPixel) {
    const OpResult gpu =
        run_op(context(), sample("pad2d", {{"left", 1}, {"right", 2}, {"replicate", true}},
                                 {{{1, 1, 1, 2}, {5, 7}}},
                                 std::vector<HostTensor>{{{1, 1, 1, 5}, {1, 2, 4, 8, 16}}}));
    ASSERT_OK(gpu.status);
    EXPECT_EQ(gpu.outputs[0], (std::vector<float>{5, 5, 7, 7, 7}));
    EXPECT_EQ(gpu.grad_inputs[0], (std::vector<float>{3, 28}));
}

TEST_P(Pad2d, RejectsBadShapes) {
    const auto status = [&](const Shape& x, const Json& attributes) {
        return run_op(context(),
                      sample("pad2d", attributes, {normal_tensor(x, 1)}, std::vector<HostTensor>{}))
            .status;
    };
    EXPECT_OK(status({1, 1, 2, 2}, {{"left", -1}}));
    EXPECT_ERROR(status({1, 1, 2, 2}, {{"left", -1}, {"right", -1}}), Code::kShape, "nothing");
    EXPECT_ERROR(status({1, 1, 2, 2}, {{"top", -2}, {"bottom", 3}}), Code::kShape, "nothing");
    EXPECT_ERROR(status({1, 2, 2}, Json::object()), Code::kShape, "'x'");
    EXPECT_OK(status({1, 1, 2, 2}, {{"left", 65}}));
    EXPECT_ERROR(status({1, 1, 2, 2}, {{"left", 65}, {"replicate", true}}), Code::kUnsupported,
                 "65 rows");
    EXPECT_ERROR(status({1, 1, 2, 2}, {{"bottom", 1 << 30}}), Code::kInvalidArgument, "bottom");
}

TEST(Pad2dCheck, RefusesResultsBeyond31Bits) {
    EXPECT_OK(ops::pad2d_check({1, 4, 16384, 16384, 1 << 12, 0, 0, 0, false}));
    EXPECT_ERROR(ops::pad2d_check({1, 4, 16384, 16384, 1 << 24, 0, 0, 0, false}),
                 Code::kUnsupported, "2^31");
    EXPECT_ERROR(ops::pad2d_check({~0U, ~0U, 2, 2, 0, 0, 0, 0, false}), Code::kUnsupported, "2^31");
}

TEST(Pad2dReference, GradcheckFloat64) {
    expect_gradcheck(PadCase{{1, 2, 3, 2}, 2, 1, -1, 3, true}.call(1));
    expect_gradcheck(PadCase{{1, 2, 3, 2}, -1, 2, 1, 0, false}.call(1));
}

}  // namespace
}  // namespace splat::test

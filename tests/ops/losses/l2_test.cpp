#include "ops/losses/l2.h"

#include <gtest/gtest.h>

#include "ops/losses/pixel_loss_case.h"

namespace splat::test {
namespace {

class L2 : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(L2);

TEST_P(L2, MatchesFloat64) {
    expect_loss(context(), "l2");
}

TEST_P(L2, EqualImagesGiveZero) {
    expect_zero_of_equals(context(), "l2");
}

TEST_P(L2, GoldenNet) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    expect_golden(context(), "l2");
}

TEST_P(L2, RejectsBadShapes) {
    expect_refusals(context(), "l2");
}

TEST(L2Reference, GradcheckFloat64) {
    expect_gradcheck_of("l2");
}

}  // namespace
}  // namespace splat::test

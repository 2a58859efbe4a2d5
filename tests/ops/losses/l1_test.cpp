#include "ops/losses/l1.h"

#include <gtest/gtest.h>

#include "ops/losses/pixel_loss_case.h"

namespace splat::test {
namespace {

class L1 : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(L1);

TEST_P(L1, MatchesFloat64) {
    expect_loss(context(), "l1");
}

TEST_P(L1, EqualImagesGiveZero) {
    expect_zero_of_equals(context(), "l1");
}

TEST_P(L1, GoldenNet) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    expect_golden(context(), "l1");
}

TEST_P(L1, RejectsBadShapes) {
    expect_refusals(context(), "l1");
}

TEST(L1Reference, GradcheckFloat64) {
    expect_gradcheck_of("l1");
}

}  // namespace
}  // namespace splat::test

#include "ops/losses/l2.h"

#include <gtest/gtest.h>

#include "ops/losses/pixel_loss_case.h"
#include "ref/losses/l2_ref.h"

namespace splat::test {
namespace {

constexpr PixelLoss kL2{"l2", ref::l2_forward<double>, ref::l2_backward<double>};

class L2 : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(L2);

TEST_P(L2, MatchesFloat64) {
    expect_float64(context(), kL2);
}

TEST_P(L2, EqualImagesGiveZero) {
    expect_zero_of_equals(context(), kL2);
}

TEST_P(L2, GoldenNet) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    expect_golden(context(), kL2);
}

TEST_P(L2, RejectsBadShapes) {
    expect_refusals(context(), kL2);
}

TEST(L2Reference, GradcheckFloat64) {
    expect_gradcheck_of(kL2);
}

}  // namespace
}  // namespace splat::test

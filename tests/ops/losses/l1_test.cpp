#include "ops/losses/l1.h"

#include <gtest/gtest.h>

#include "ops/losses/pixel_loss_case.h"
#include "ref/losses/l1_ref.h"

namespace splat::test {
namespace {

constexpr PixelLoss kL1{"l1", ref::l1_forward<double>, ref::l1_backward<double>};

class L1 : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(L1);

TEST_P(L1, MatchesFloat64) {
    expect_float64(context(), kL1);
}

TEST_P(L1, EqualImagesGiveZero) {
    expect_zero_of_equals(context(), kL1);
}

TEST_P(L1, GoldenNet) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    expect_golden(context(), kL1);
}

TEST_P(L1, RejectsBadShapes) {
    expect_refusals(context(), kL1);
}

TEST(L1Reference, GradcheckFloat64) {
    expect_gradcheck_of(kL1);
}

}  // namespace
}  // namespace splat::test

#include "eval/ledger.h"

#include <gtest/gtest.h>

#include <limits>

namespace splat::eval {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

scene::Gaussians gaussians(std::size_t count) {
    scene::Gaussians made;
    made.means.assign(3 * count, 0);
    made.log_scales.assign(3 * count, -3);
    made.rotations.assign(4 * count, 0.5F);
    made.opacity_logits.assign(count, 0);
    made.sh.assign(3 * count, 0.1F);
    return made;
}

TEST(Ledger, CountsEachGaussianOnce) {
    scene::Gaussians made = gaussians(6);
    made.means[0] = kNaN;
    made.log_scales[1] = kInfinity;  // the same Gaussian
    made.sh[3 * 2 + 1] = -kInfinity;
    made.opacity_logits[3] = -6;  // opacity 0.0025
    made.opacity_logits[4] = kNaN;
    Ledger ledger;
    count_gaussians(made, ledger);
    EXPECT_EQ(ledger.gaussians, 6U);
    EXPECT_EQ(ledger.gaussians_not_finite, 3U);
    EXPECT_EQ(ledger.invisible, 1U);
    EXPECT_EQ(ledger.visible, 2U);
    EXPECT_FALSE(ledger.finite());
}

TEST(Ledger, ACountOfAnyKindIsNotFinite) {
    EXPECT_TRUE(Ledger().finite());
    Ledger outputs, images, blank;
    outputs.outputs_not_finite = 1;
    images.images_not_finite = 1;
    blank.images_blank = 5;
    EXPECT_FALSE(outputs.finite());
    EXPECT_FALSE(images.finite());
    EXPECT_TRUE(blank.finite());
    Ledger sum;
    sum.add(outputs);
    sum.add(blank);
    sum.add(blank);
    EXPECT_EQ(sum.outputs_not_finite, 1U);
    EXPECT_EQ(sum.images_blank, 10U);
}

TEST(Ledger, CountsNumbersThatAreNotFinite) {
    const float values[] = {1, kNaN, -kInfinity, 3.4e38F};
    EXPECT_EQ(count_not_finite(values), 2U);
}

TEST(Ledger, APlainImageHasOneColour) {
    const float image[] = {1, 1, 0, 0, 0.5F, 0.5F};
    EXPECT_TRUE(is_plain(image, {1, 0, 0.5F}));
    EXPECT_FALSE(is_plain(image, {1, 0, 0}));
    const float other[] = {1, 1, 0, 0.1F, 0.5F, 0.5F};
    EXPECT_FALSE(is_plain(other, {1, 0, 0.5F}));
}

}  // namespace
}  // namespace splat::eval

#include "eval/ledger.h"

#include <gtest/gtest.h>

namespace splat::eval {
namespace {

TEST(Ledger, TakesEachGaussianOnce) {
    model::Ledger prediction;
    prediction.gaussians = 6;
    prediction.outputs_not_finite = 2;
    prediction.set = {.numbers_not_finite = 5, .not_finite = 3, .faint = 2, .invisible = 1};
    Ledger ledger;
    ledger.take(prediction);
    EXPECT_EQ(ledger.gaussians, 6U);
    EXPECT_EQ(ledger.outputs_not_finite, 2U);
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

TEST(Ledger, APlainImageHasOneColour) {
    const float image[] = {1, 1, 0, 0, 0.5F, 0.5F};
    EXPECT_TRUE(is_plain(image, {1, 0, 0.5F}));
    EXPECT_FALSE(is_plain(image, {1, 0, 0}));
    const float other[] = {1, 1, 0, 0.1F, 0.5F, 0.5F};
    EXPECT_FALSE(is_plain(other, {1, 0, 0.5F}));
}

}  // namespace
}  // namespace splat::eval

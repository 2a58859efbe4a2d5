#include "tables/srn_text.h"

#include <gtest/gtest.h>

#include "support/expect_status.h"

namespace splat::tables {
namespace {

TEST(SrnText, FocalLengthsAreInWidthsAndHeights) {
    const auto focal =
        focal_of("12 4 3 0\n0 0 0\n1\n6 8\n");  // f cx cy 0, centre, scale, height and width
    ASSERT_OK(focal.status());
    EXPECT_EQ(focal.value().x, 1.5);
    EXPECT_EQ(focal.value().y, 2);
}

}  // namespace
}  // namespace splat::tables

#include "tables/srn_text.h"

#include <gtest/gtest.h>

#include "support/expect_status.h"

namespace splat::tables {
namespace {

TEST(SrnText, FocalLengthsAreInWidthsAndHeights) {
    const auto focal =
        need(focal_of("12 4 3 0\n0 0 0\n1\n6 8\n"));  // f cx cy 0, centre, scale, height and width
    EXPECT_EQ(focal.x, 1.5);
    EXPECT_EQ(focal.y, 2);
}

}  // namespace
}  // namespace splat::tables

#include "core/decode_budget.h"

#include <gtest/gtest.h>

#include "support/expect_status.h"

namespace splat {
namespace {

TEST(DecodeBudget, CannotBeOverrun) {
    DecodeBudget budget(10, {4, 60, 1});
    EXPECT_OK(budget.take(10, 8, "x"));
    EXPECT_ERROR(budget.take(21, 1, "x"), Code::kFormat,
                 "x: 21 x 1 bytes are too many for a file of 10 bytes, which may take 100;");
    EXPECT_ERROR(budget.take(1ULL << 60U, 1ULL << 60U, "x"), Code::kFormat,
                 "(splat_decode_set_limits, --decode-scale)");
    EXPECT_OK(budget.take(20, 1, "x"));
    EXPECT_FALSE(budget.take(1, 1, "x").ok());
    EXPECT_EQ((DecodeLimits{64, 100, 1}.allowed(10)), 740U);
    EXPECT_EQ((DecodeLimits{64, 100, 1}.allowed(~0ULL)), ~0ULL);
}

TEST(DecodeBudget, HasTheLimitsOfTheProcess) {
    EXPECT_OK(DecodeBudget(0).take(64U << 20U, 1, "x"));
    set_decode_limits({1, 2, 3, 4});
    DecodeBudget budget(10);
    EXPECT_EQ(budget.limits().max_items, 3U);
    EXPECT_FALSE(budget.take(13, 1, "x").ok());
    EXPECT_OK(budget.take(12, 1, "x"));
    set_decode_limits({});
    EXPECT_EQ(decode_limits().max_jpeg_scans, 100U);
}

}  // namespace
}  // namespace splat

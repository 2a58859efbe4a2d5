#include "core/fault.h"

#include <gtest/gtest.h>

#include <vector>

namespace splat {
namespace {

#if SPLAT_FAULT_POINTS

std::vector<bool> visit(const char* name, int times) {
    std::vector<bool> failed;
    for (int i = 0; i < times; ++i) failed.push_back(fault::hit(name));
    return failed;
}

TEST(Fault, FailsTheChosenHitsOfTheChosenPoint) {
    fault::arm("a", 2, 2);
    EXPECT_EQ(visit("a", 5), (std::vector<bool>{false, true, true, false, false}));
    EXPECT_EQ(visit("b", 3), (std::vector<bool>{false, false, false}));
    EXPECT_EQ(fault::disarm(), 5U);
}

TEST(Fault, FailsFromOneHitOn) {
    fault::arm("a", 3);
    EXPECT_EQ(visit("a", 5), (std::vector<bool>{false, false, true, true, true}));
    EXPECT_EQ(fault::disarm(), 5U);
}

TEST(Fault, CountsAllPointsTogether) {
    fault::arm(nullptr, 3, 1);
    EXPECT_FALSE(SPLAT_FAULT("a"));
    EXPECT_FALSE(SPLAT_FAULT("b"));
    EXPECT_TRUE(SPLAT_FAULT("c"));
    EXPECT_FALSE(SPLAT_FAULT("a"));
    EXPECT_EQ(fault::disarm(), 4U);
}

TEST(Fault, NothingFailsUnarmed) {
    fault::arm("a", 1);
    fault::disarm();
    EXPECT_FALSE(SPLAT_FAULT("a"));
}

#else

TEST(Fault, CompiledOut) {
    EXPECT_FALSE(SPLAT_FAULT("a"));
    GTEST_SKIP() << "fault points are compiled out of this build";
}

#endif

}  // namespace
}  // namespace splat

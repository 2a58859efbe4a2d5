#include "vkrun/data/for_each_index.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <vector>

#include "support/system.h"

namespace vkrun {
namespace {

/// All numbers once.
bool visits_all(std::uint32_t count, std::uint32_t threads) {
    std::vector<std::atomic<int>> visits(count);
    for_each_index("test", count, threads, [&](std::uint32_t i) { ++visits[i]; });
    for (const std::atomic<int>& each : visits)
        if (each != 1) return false;
    return true;
}

TEST(ForEachIndex, VisitsAll) {
    for (const std::uint32_t count : {0U, 1U, 100U})
        for (const std::uint32_t threads : {0U, 1U, 7U}) EXPECT_TRUE(visits_all(count, threads));
    EXPECT_THROW(for_each_index("test", 9, 3, [](std::uint32_t) { throw std::runtime_error("x"); }),
                 std::runtime_error);
}

/// The system refuses threads to a user of too many processes, unless that is root.
TEST(ForEachIndex, NeedsNoThread) {
    if (!splat::test::kHasFileLimit) GTEST_SKIP() << "this system limits no process";
    const splat::test::NoMoreThreads limit;
    ASSERT_TRUE(limit.works());
    EXPECT_TRUE(visits_all(100, 4));
}

}  // namespace
}  // namespace vkrun

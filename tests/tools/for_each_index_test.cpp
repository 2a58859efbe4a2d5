#include "vkrun/data/for_each_index.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <stdexcept>
#include <vector>

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
    const pid_t child = fork();
    if (child == 0) {
        constexpr uid_t kNobody = 65534;
        const rlimit none{0, 0};
        if (setrlimit(RLIMIT_NPROC, &none) != 0) _exit(2);
        if (geteuid() == 0 && setuid(kNobody) != 0) _exit(3);
        _exit(visits_all(100, 4) ? 0 : 1);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status)) << "signal " << WTERMSIG(status);
    EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace vkrun

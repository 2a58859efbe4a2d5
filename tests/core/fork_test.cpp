#include "core/fork.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

#include "support/system.h"

namespace splat {
namespace {

using test::in_child;

std::atomic<int> g_calls{0};

TEST(Fork, CountsGenerations) {
    SPLAT_NEED_FORK();
    const std::uint32_t before = fork_generation();
    EXPECT_EQ(in_child([&] {
                  const int inner =
                      in_child([&] { return fork_generation() == before + 2 ? 0 : 1; });
                  return inner == 0 && fork_generation() == before + 1 ? 0 : 1;
              }),
              0);
    EXPECT_EQ(fork_generation(), before);
}

TEST(Fork, CallsFunctionsInTheChildOnly) {
    SPLAT_NEED_FORK();
    at_fork_in_child([] { g_calls.fetch_add(1); });
    EXPECT_EQ(in_child([] { return g_calls.load(); }), 1);
    EXPECT_EQ(g_calls, 0);
}

/// Other threads hold it in turns, shared and not, when the process forks.
TEST(Fork, ChildFindsMutexesFreeAndDataWhole) {
    SPLAT_NEED_FORK();
    struct Guarded {
        ForkMutex mutex;
        int a = 0, b = 0;  // equal whenever nobody holds it exclusively
    } guarded;
    std::atomic<bool> stop{false};
    std::vector<std::thread> threads;
    for (int i = 0; i < 2; ++i)
        threads.emplace_back([&] {
            while (!stop) {
                const std::lock_guard lock(guarded.mutex);
                ++guarded.a;
                std::this_thread::yield();
                ++guarded.b;
            }
        });
    threads.emplace_back([&] {
        while (!stop) const std::shared_lock lock(guarded.mutex);
    });
    for (int round = 0; round < 20; ++round)
        EXPECT_EQ(in_child([&] {
                      test::end_after(60);  // a child may wait for a thread that is not there
                      const std::lock_guard lock(guarded.mutex);
                      return guarded.a == guarded.b ? 0 : 1;
                  }),
                  0);
    stop = true;
    for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace splat

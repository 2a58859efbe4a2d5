#include "core/fork.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <thread>
#include <vector>

namespace splat {
namespace {

/// Run `body` in a forked child. Returns what it returns, or -1 if the child did not end by itself.
template <class Body>
int in_child(Body&& body) {
    const pid_t child = fork();
    if (child == 0) _exit(body());
    int status = 0;
    EXPECT_EQ(waitpid(child, &status, 0), child);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

std::atomic<int> g_calls{0};

TEST(Fork, CountsGenerations) {
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
    at_fork_in_child([] { g_calls.fetch_add(1); });
    EXPECT_EQ(in_child([] { return g_calls.load(); }), 1);
    EXPECT_EQ(g_calls, 0);
}

/// Other threads hold it in turns, shared and not, when the process forks.
TEST(Fork, ChildFindsMutexesFreeAndDataWhole) {
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
                      alarm(60);  // ends a child that waits for a thread that is not there
                      const std::lock_guard lock(guarded.mutex);
                      return guarded.a == guarded.b ? 0 : 1;
                  }),
                  0);
    stop = true;
    for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace splat

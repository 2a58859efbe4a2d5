#include "core/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

namespace splat {
namespace {

TEST(ParallelFor, DoesEachOnce) {
    for (const std::size_t threads : {0U, 1U, 3U})
        for (const std::size_t count : {0U, 1U, 2U, 1000U}) {
            std::vector<std::atomic<int>> times(count);
            const Status status = parallel_for(count, threads, [&](std::size_t i) {
                ++times[i];
                return Status();
            });
            EXPECT_TRUE(status.ok());
            for (const auto& done : times) EXPECT_EQ(done, 1);
        }
}

TEST(ParallelFor, ReturnsTheErrorOfALoop) {
    for (int round = 0; round < 100; ++round) {
        const Status status = parallel_for(100, 4, [](std::size_t i) {
            return i % 10 == 7 ? error(Code::kInvalidArgument, "%zu", i) : Status();
        });
        EXPECT_EQ(status.code(), Code::kInvalidArgument);
        EXPECT_EQ(status.message(), "7");
    }
}

TEST(ParallelFor, StopsAtTheFirstFailure) {
    for (const std::size_t threads : {1U, 2U, 4U})
        for (const bool throws : {false, true}) {
            std::atomic<std::size_t> begun = 0;
            const auto work = [&](std::size_t i) {
                ++begun;
                if (i > 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
                if (i == 0 && throws) throw std::runtime_error("as asked");
                return i == 0 ? error(Code::kInternal, "no") : Status();
            };
            if (throws)
                EXPECT_THROW(static_cast<void>(parallel_for(10'000, threads, work)),
                             std::runtime_error);
            else
                EXPECT_FALSE(parallel_for(10'000, threads, work).ok());
            EXPECT_LT(begun, 5'000U) << "the others would take seconds to get that far";
        }
}

TEST(ParallelFor, ThrowsWhatWorkThrows) {
    for (const std::size_t threads : {1U, 2U, 4U})
        for (const std::size_t bad : {0U, 1U, 99U}) {
            const auto work = [&](std::size_t i) {
                if (i == bad) throw std::runtime_error("as asked");
                return Status();
            };
            EXPECT_THROW(static_cast<void>(parallel_for(100, threads, work)), std::runtime_error);
        }
}

}  // namespace
}  // namespace splat

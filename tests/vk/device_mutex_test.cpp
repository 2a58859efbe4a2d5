#include "vk/device_mutex.h"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "support/expect_status.h"

namespace splat::vk {
namespace {

/// Notes when it is done.
struct Note : DeferredWork {
    Note(std::vector<int>& to, int number) : notes(to), value(number) {}
    ~Note() override { notes.push_back(value); }
    std::vector<int>& notes;
    int value;
};

TEST(DeviceMutex, DoesWorkAtOnceWhenFree) {
    DeviceMutex mutex;
    std::vector<int> notes;
    mutex.defer(std::make_unique<Note>(notes, 1));
    EXPECT_EQ(notes, std::vector<int>{1});
    EXPECT_TRUE(mutex.try_lock());
    mutex.unlock();
}

TEST(DeviceMutex, LeavesWorkToTheHolderInOrder) {
    DeviceMutex mutex;
    std::vector<int> notes;
    mutex.lock();
    std::thread([&] {
        mutex.defer(std::make_unique<Note>(notes, 1));
        mutex.defer(std::make_unique<Note>(notes, 2));
    }).join();
    mutex.defer(std::make_unique<Note>(notes, 3));  // the holder's own
    EXPECT_TRUE(notes.empty());
    mutex.unlock();
    EXPECT_EQ(notes, (std::vector<int>{1, 2, 3}));
}

/// The count has no lock of its own: work outside the mutex would be a race, and lost work a gap.
TEST(DeviceMutex, LosesNoWorkOfManyThreads) {
    constexpr int kThreads = 4, kEach = 2000;
    DeviceMutex mutex;
    struct Count : DeferredWork {
        explicit Count(int& of) : count(of) {}
        ~Count() override { ++count; }
        int& count;
    };
    int count = 0;
    std::vector<std::thread> threads;
    for (int i = 0; i < kThreads; ++i)
        threads.emplace_back([&, i] {
            for (int k = 0; k < kEach; ++k) {
                mutex.defer(std::make_unique<Count>(count));
                if (i % 2 == 0) const std::lock_guard lock(mutex);
            }
        });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(count, kThreads * kEach);
}

TEST(DeviceMutex, CancelsTheCallThatHoldsIt) {
    DeviceMutex mutex;
    {
        const std::lock_guard lock(mutex);
        EXPECT_OK(mutex.check());
        mutex.interrupt().raise();
        EXPECT_ERROR(mutex.check(), Code::kCancelled, "splat_device_cancel");
        {
            const Uncancelled whole(mutex);
            EXPECT_OK(mutex.check());
        }
        EXPECT_ERROR(mutex.check(), Code::kCancelled, "");
    }
    const std::lock_guard later(mutex);
    EXPECT_OK(mutex.check());
}

TEST(DeviceMutex, CancelsTheCallThatWaitsForIt) {
    DeviceMutex mutex;
    mutex.lock();
    std::atomic<bool> waits = false;
    std::thread waiting([&] {
        const DeviceCall call(mutex);  // begins before the interrupt for sure
        waits = true;
        const std::lock_guard lock(mutex);
        EXPECT_ERROR(mutex.check(), Code::kCancelled, "");
    });
    while (!waits) std::this_thread::yield();
    mutex.interrupt().raise();
    mutex.unlock();
    waiting.join();
}

TEST(DeviceMutex, OneCallMayTakeItSeveralTimes) {
    DeviceMutex mutex, other;
    {
        const DeviceCall call(mutex);
        { const std::lock_guard lock(mutex); }
        mutex.interrupt().raise();
        {
            const std::lock_guard lock(mutex);
            EXPECT_ERROR(mutex.check(), Code::kCancelled, "");
        }
        const std::lock_guard lock(other);
        EXPECT_OK(other.check());
    }
    const std::lock_guard lock(mutex);
    EXPECT_OK(mutex.check());
}

}  // namespace
}  // namespace splat::vk

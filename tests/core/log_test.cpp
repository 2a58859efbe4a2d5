#include "core/log.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace splat {
namespace {

struct Seen {
    std::vector<std::pair<int, std::string>> messages;
};

void collect(void* user, int level, const char* message) {
    static_cast<Seen*>(user)->messages.emplace_back(level, message);
}

class Log : public testing::Test {
  protected:
    void TearDown() override { set_log_sink(nullptr, nullptr, LogLevel::kWarning); }
    Seen seen_;
};

TEST_F(Log, SilentWithoutSink) {
    set_log_sink(nullptr, nullptr, LogLevel::kDebug);
    log(LogLevel::kError, "nobody hears this");
}

TEST_F(Log, PassesMessagesFromTheLevelOn) {
    set_log_sink(collect, &seen_, LogLevel::kWarning);
    log(LogLevel::kDebug, "a");
    log(LogLevel::kInfo, "b");
    log(LogLevel::kWarning, "c");
    log(LogLevel::kError, std::string_view("dxyz").substr(0, 1));
    const std::vector<std::pair<int, std::string>> expected{{3, "c"}, {4, "d"}};
    EXPECT_EQ(seen_.messages, expected);
}

TEST_F(Log, SurvivesAThrowingSink) {
    set_log_sink([](void*, int, const char*) { throw std::runtime_error("sink"); }, nullptr,
                 LogLevel::kDebug);
    log(LogLevel::kError, "x");
    log(LogLevel::kError, "the lock was released");
}

TEST_F(Log, FinishesMessagesBeforeReplacingTheSink) {
    // A message still under way after set_log_sink would be missing from the count.
    static std::atomic<int> inside;
    inside = 0;
    const LogSink sink = [](void*, int, const char*) { ++inside; };
    std::atomic<bool> stop{false};
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i)
        threads.emplace_back([&stop] {
            while (!stop) log(LogLevel::kError, "x");
        });
    for (int i = 0; i < 200; ++i) {
        set_log_sink(sink, nullptr, LogLevel::kDebug);
        set_log_sink(nullptr, nullptr, LogLevel::kDebug);
        const int after = inside;
        std::this_thread::yield();
        EXPECT_EQ(inside, after);
    }
    stop = true;
    for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace splat

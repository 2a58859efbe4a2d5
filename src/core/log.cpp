#include "core/log.h"

#include <atomic>
#include <chrono>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/fork.h"

namespace splat {
namespace {

constexpr std::size_t kMostWaiting = 1000;
constexpr int kSilent = std::numeric_limits<int>::max();

struct Registration {
    LogSink function;
    void* user;
    int min_level;
    std::atomic<int> running{0};  ///< calls of `function` that have not returned
};

struct Sink {
    ForkMutex mutex;
    std::shared_ptr<Registration> current;
    std::atomic<int> min_level{kSilent};  ///< least level of `current`
};

struct Message {
    LogLevel level;
    std::string text;
};

struct ThreadLog {
    int held = 0;
    bool inside = false;  ///< the sink
    std::vector<Message> waiting;
    std::size_t dropped = 0;
};

ThreadLog& this_thread() {
    thread_local ThreadLog instance;
    return instance;
}

Sink& sink();

/// In the child only this thread is left.
void count_in_child() {
    if (sink().current != nullptr) sink().current->running = this_thread().inside ? 1 : 0;
}

Sink& sink() {
    return for_ever<Sink, count_in_child>();
}

/// Counts a running call, during which messages of this thread are dropped.
struct Running : NoCopy {
    explicit Running(Registration& to) : registration(to) { this_thread().inside = true; }
    ~Running() {
        this_thread().inside = false;
        --registration.running;
    }
    Registration& registration;
};

void call_sink(LogLevel level, const char* text) {
    std::shared_ptr<Registration> current;
    {
        const std::shared_lock lock(sink().mutex);
        current = sink().current;
        if (current == nullptr || static_cast<int>(level) < current->min_level) return;
        current->running.fetch_add(1);
    }
    const Running running(*current);
    current->function(current->user, static_cast<int>(level), text);
}

}  // namespace

void set_log_sink(LogSink function, void* user, LogLevel min_level) {
    std::shared_ptr<Registration> registration;
    const int level = static_cast<int>(min_level);
    if (function != nullptr) {
        registration = std::make_shared<Registration>();
        registration->function = function;
        registration->user = user;
        registration->min_level = level;
    }
    {
        const std::lock_guard lock(sink().mutex);
        sink().min_level = function != nullptr ? level : kSilent;
        std::swap(sink().current, registration);
    }
    // Inside a sink the wait could be for this thread, or for one that waits for this one.
    if (registration == nullptr || this_thread().inside) return;
    // Without atomic::wait: that of GCC 12's library loses wakeups on systems without futex, such as Windows.
    while (registration->running != 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

void log(LogLevel level, std::string_view message) noexcept {
    try {
        ThreadLog& own = this_thread();
        if (static_cast<int>(level) < sink().min_level || own.inside) return;
        if (own.held == 0) return call_sink(level, std::string(message).c_str());
        if (own.waiting.size() < kMostWaiting)
            own.waiting.push_back({level, std::string(message)});
        else
            ++own.dropped;
    } catch (...) {
    }
}

void hold_log() noexcept {
    ++this_thread().held;
}

bool release_log() noexcept {
    ThreadLog& own = this_thread();
    return --own.held == 0 && !own.waiting.empty() && !own.inside;
}

void deliver_log() noexcept {
    ThreadLog& own = this_thread();
    const std::vector<Message> messages = std::move(own.waiting);
    own.waiting.clear();
    const std::size_t dropped = std::exchange(own.dropped, 0);
    try {
        for (const Message& message : messages) call_sink(message.level, message.text.c_str());
        if (dropped > 0)
            call_sink(
                LogLevel::kWarning,
                (std::to_string(dropped) + " more messages of this call were dropped").c_str());
    } catch (...) {
    }
}

}  // namespace splat

#include "core/fork.h"

#include <atomic>
#include <chrono>
#include <new>
#include <thread>

#include "core/os/process.h"

namespace splat {
namespace {

std::atomic<std::uint32_t> g_forks{0};

}  // namespace

/// Every living ForkMutex.
struct ForkLocks {
    static constexpr std::size_t kMostFunctions = 8;

    std::mutex mutex;
    ForkMutex* first = nullptr;
    void (*in_child[kMostFunctions])() = {};
    std::size_t functions = 0;

    /// Never destroyed: mutexes may live until the end of the process.
    static ForkLocks& all() {
        static ForkLocks* const instance = [] {
            os::on_fork(before, in_parent, after);
            return new ForkLocks;
        }();
        return *instance;
    }

    /// All or none at a time, because their holders take others in any order.
    static void before() {
        for (;;) {
            all().mutex.lock();
            ForkMutex* held = all().first;
            while (held != nullptr && held->try_lock_shared()) held = held->next_;
            if (held == nullptr) return;
            for (ForkMutex* one = all().first; one != held; one = one->next_) one->unlock_shared();
            all().mutex.unlock();
            std::this_thread::sleep_for(std::chrono::microseconds(100));
        }
    }
    static void in_parent() {
        for (ForkMutex* one = all().first; one != nullptr; one = one->next_) one->unlock_shared();
        all().mutex.unlock();
    }
    static void after() {
        for (ForkMutex* one = all().first; one != nullptr; one = one->next_) one->renew();
        g_forks.fetch_add(1, std::memory_order_relaxed);
        for (std::size_t i = 0; i < all().functions; ++i) all().in_child[i]();
        all().mutex.unlock();
    }
};

namespace {

/// Before any fork that matters: generations are compared without a ForkMutex, too.
[[maybe_unused]] const bool g_registered = (static_cast<void>(ForkLocks::all()), true);

}  // namespace

std::uint32_t fork_generation() noexcept {
    return g_forks.load(std::memory_order_relaxed);
}

void at_fork_in_child(void (*function)()) noexcept {
    ForkLocks& all = ForkLocks::all();
    const std::lock_guard lock(all.mutex);
    if (all.functions < ForkLocks::kMostFunctions) all.in_child[all.functions++] = function;
}

ForkMutex::ForkMutex() : mutex_(new (place_) std::shared_mutex) {
    ForkLocks& all = ForkLocks::all();
    const std::lock_guard lock(all.mutex);
    next_ = all.first;
    if (next_ != nullptr) next_->previous_ = this;
    all.first = this;
}

ForkMutex::~ForkMutex() {
    {
        ForkLocks& all = ForkLocks::all();
        const std::lock_guard lock(all.mutex);
        (previous_ != nullptr ? previous_->next_ : all.first) = next_;
        if (next_ != nullptr) next_->previous_ = previous_;
    }
    mutex_->~shared_mutex();
}

void ForkMutex::renew() {
    mutex_ = new (place_) std::shared_mutex;
}

}  // namespace splat

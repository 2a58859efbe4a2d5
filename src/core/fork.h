#pragma once

#include <cstdint>
#include <mutex>
#include <shared_mutex>

#include "core/no_copy.h"

namespace splat {

/// How many forks lie between the process that loaded the library and this one.
std::uint32_t fork_generation() noexcept;

/// Call `function` in every child forked from now on, before fork() returns there. Ignores what does
/// not fit in a small table.
void at_fork_in_child(void (*function)()) noexcept;

/// The only T, made at the first use, and never destroyed: threads may use it while the process ends. Children call
/// InChild as above.
template <class T, void (*InChild)() = nullptr>
T& for_ever() {
    static T* const instance = [] {
        if constexpr (InChild != nullptr) at_fork_in_child(InChild);
        return new T;
    }();
    return *instance;
}

/// A shared mutex that a forked child finds free and with whole data: a fork waits while a thread
/// holds it exclusively.
class ForkMutex : NoCopy {
  public:
    ForkMutex();
    ~ForkMutex();

    void lock() { mutex_->lock(); }
    bool try_lock() { return mutex_->try_lock(); }
    void unlock() { mutex_->unlock(); }
    void lock_shared() { mutex_->lock_shared(); }
    bool try_lock_shared() { return mutex_->try_lock_shared(); }
    void unlock_shared() { mutex_->unlock_shared(); }

  private:
    friend struct ForkLocks;
    /// A new one in the child: the threads that held the old one do not exist there.
    void renew();

    alignas(std::shared_mutex) unsigned char place_[sizeof(std::shared_mutex)];
    std::shared_mutex* mutex_;
    ForkMutex* next_ = nullptr;
    ForkMutex* previous_ = nullptr;
};

}  // namespace splat

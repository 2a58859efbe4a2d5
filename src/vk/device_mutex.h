#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <thread>

#include "core/fork.h"
#include "core/interrupt.h"
#include "core/status.h"

namespace splat::vk {

/// Work under a DeviceMutex for a thread that must not wait for it. Its destructor does the work.
struct DeferredWork : NoCopy {
    virtual ~DeferredWork() = default;

    DeferredWork* next = nullptr;
};

/// The mutex of a Context. Its holder also does the work that other threads left, and learns whether
/// its call was cancelled. In a forked child nobody waits for it, and check() refuses.
class DeviceMutex : NoCopy {
  public:
    void lock();
    bool try_lock();
    void unlock();

    /// Do the work now if the mutex is free; else its holder does it before others get the mutex.
    /// Never waits for a holder, who may be this thread.
    void defer(std::unique_ptr<DeferredWork> work) noexcept;

    /// Cancels the calls that hold the mutex or wait for it.
    [[nodiscard]] Interrupt& interrupt() { return interrupt_; }

    /// True in a child of the process that made it.
    [[nodiscard]] bool forked() const noexcept { return generation_ != fork_generation(); }

    /// For the holder. Errors: kInvalidState in a forked child; kCancelled if the interrupt was raised
    /// since it asked for the mutex, or since its DeviceCall began.
    [[nodiscard]] Status check() const;

    /// True while an Uncancelled lives.
    [[nodiscard]] bool uncancelled() const { return uncancelled_; }

    /// Call `body` with the mutex held. Errors: also those of check().
    template <class Body>
    auto call(Body&& body) -> decltype(body()) {
        const std::lock_guard lock(*this);
        SPLAT_TRY(check());
        return body();
    }

  private:
    friend class DeviceCall;
    friend class Uncancelled;
    void held(std::uint64_t seen) noexcept;
    [[nodiscard]] std::uint64_t seen() const noexcept;
    void do_work() noexcept;

    std::mutex mutex_;
    std::atomic<std::thread::id> holder_{};
    std::atomic<DeferredWork*> first_{nullptr};  ///< latest first
    Interrupt interrupt_;
    const std::uint32_t generation_ = fork_generation();
    std::uint64_t seen_ = interrupt_.count();  ///< when the call of the latest holder began
    bool uncancelled_ = false;                 ///< see Uncancelled
};

/// While it lives, the holder's work is not cancelled: for lists that must all run or none.
/// A list that is noted meanwhile is cancelled until it begins, and then runs to its end.
class Uncancelled : NoCopy {
  public:
    explicit Uncancelled(DeviceMutex& mutex) : mutex_(mutex) { mutex_.uncancelled_ = true; }
    ~Uncancelled() { mutex_.uncancelled_ = false; }

  private:
    DeviceMutex& mutex_;
};

/// Makes what this thread does on a device from here on one call that can be cancelled: for calls that
/// take the mutex several times.
class DeviceCall : NoCopy {
  public:
    explicit DeviceCall(DeviceMutex& mutex);
    ~DeviceCall();

  private:
    friend class DeviceMutex;
    const DeviceMutex& mutex_;
    std::uint64_t seen_;
    const DeviceCall* outer_;
};

}  // namespace splat::vk

#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

#include "core/no_copy.h"
#include "core/status.h"

namespace splat::train {

/// A thread that makes calls of a group, one after another, while its owner uses the device.
///
/// From post() until wait() for the last call that was posted, nobody else may use the group.
class ExchangeThread : NoCopy {
  public:
    /// Errors: kOutOfHostMemory if the system starts no more threads. Nothing may be posted then.
    Status start();
    /// Waits for all calls.
    ~ExchangeThread();

    /// Returns the number of the call, which counts from 1.
    std::uint64_t post(std::function<Status()> call);
    /// Wait for a call and those before it. Errors: that of the first call which failed. Later ones are not made.
    Status wait(std::uint64_t number);

  private:
    void run();

    std::mutex mutex_;  ///< guards the members below, except thread_
    std::condition_variable changed_;
    std::deque<std::function<Status()>> calls_;
    std::uint64_t posted_ = 0, done_ = 0;
    Status failed_;
    bool stop_ = false;
    std::thread thread_;
};

}  // namespace splat::train

#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "core/no_copy.h"

namespace splat::vk {

/// Tells on standard error, once, that a call into a driver has not returned: the caller, who waits for it, can tell
/// nothing. Compilers of shaders may take half a minute.
class Watchdog : NoCopy {
  public:
    /// `call` of `device`, as "the compilation of" `what`; each may be empty. Where no thread is left nothing is told.
    Watchdog(const char* device, const char* call, const char* what,
             std::chrono::milliseconds patience = std::chrono::minutes(1)) noexcept;
    ~Watchdog();

  private:
    char text_[400];
    std::mutex mutex_;
    std::condition_variable ended_;
    bool end_ = false;
    std::thread thread_;
};

}  // namespace splat::vk

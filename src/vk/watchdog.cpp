#include "vk/watchdog.h"

#include <cstdio>

namespace splat::vk {

Watchdog::Watchdog(const char* device, const char* call, const char* what,
                   std::chrono::milliseconds patience) noexcept {
    std::snprintf(text_, sizeof text_, "%s%s%s%s%s", device, *device == '\0' ? "" : ": ", call,
                  *what == '\0' ? "" : " ", what);
    try {
        thread_ = std::thread([this, patience] {
            std::unique_lock lock(mutex_);
            if (ended_.wait_for(lock, patience, [this] { return end_; })) return;
            std::fprintf(stderr,
                         "libsplat: %s has not returned for %.3g s. If that goes on, end this "
                         "process; update the "
                         "driver, or choose another device (vkrun devices) or plain kernels "
                         "(SPLAT_KERNELS=plain)\n",
                         text_, std::chrono::duration<double>(patience).count());
        });
    } catch (...) {
    }
}

Watchdog::~Watchdog() {
    if (!thread_.joinable()) return;
    {
        const std::lock_guard lock(mutex_);
        end_ = true;
    }
    ended_.notify_one();
    thread_.join();
}

}  // namespace splat::vk

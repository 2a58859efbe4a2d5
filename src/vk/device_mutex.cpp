#include "vk/device_mutex.h"

#include <utility>

namespace splat::vk {
namespace {

thread_local const DeviceCall* t_call = nullptr;

}  // namespace

std::uint64_t DeviceMutex::seen() const noexcept {
    std::uint64_t count = interrupt_.count();
    for (const DeviceCall* call = t_call; call != nullptr; call = call->outer_)
        if (&call->mutex_ == this) count = call->seen_;
    return count;
}

void DeviceMutex::held(std::uint64_t seen) noexcept {
    holder_.store(std::this_thread::get_id(), std::memory_order_relaxed);
    seen_ = seen;
}

void DeviceMutex::lock() {
    if (forked()) return;
    const std::uint64_t before = seen();
    mutex_.lock();
    held(before);
}

bool DeviceMutex::try_lock() {
    if (forked()) return true;
    const std::uint64_t before = seen();
    if (!mutex_.try_lock()) return false;
    held(before);
    return true;
}

void DeviceMutex::unlock() {
    if (forked()) return;
    for (;;) {
        do_work();
        holder_.store({}, std::memory_order_relaxed);
        mutex_.unlock();
        // Work that was added before this exchange is seen here; the thread that adds some after it
        // finds the mutex free.
        DeferredWork* none = nullptr;
        if (first_.compare_exchange_strong(none, nullptr, std::memory_order_acq_rel)) return;
        if (!try_lock()) return;  // the new holder does it
    }
}

void DeviceMutex::defer(std::unique_ptr<DeferredWork> work) noexcept {
    DeferredWork* const added = work.release();
    added->next = first_.load(std::memory_order_relaxed);
    while (!first_.compare_exchange_weak(added->next, added, std::memory_order_acq_rel)) {
    }
    if (holder_.load(std::memory_order_relaxed) == std::this_thread::get_id()) return;
    if (try_lock()) unlock();
}

void DeviceMutex::do_work() noexcept {
    while (DeferredWork* taken = first_.exchange(nullptr, std::memory_order_acq_rel)) {
        DeferredWork* oldest = nullptr;
        while (taken != nullptr) {
            DeferredWork* const next = taken->next;
            taken->next = oldest;
            oldest = taken;
            taken = next;
        }
        while (oldest != nullptr) delete std::exchange(oldest, oldest->next);
    }
}

Status DeviceMutex::check() const {
    if (forked())
        return bad_state(
            "this process was forked from the one that opened the device: start children with "
            "spawn, or fork before the first device is opened");
    if (uncancelled_ || interrupt_.count() == seen_) return {};
    return error(
        Code::kCancelled,
        "splat_device_cancel cancelled the call; what it was to write is undefined, and the "
        "object can be used again");
}

DeviceCall::DeviceCall(DeviceMutex& mutex) : mutex_(mutex), seen_(mutex.seen()), outer_(t_call) {
    t_call = this;
}

DeviceCall::~DeviceCall() {
    t_call = outer_;
}

}  // namespace splat::vk

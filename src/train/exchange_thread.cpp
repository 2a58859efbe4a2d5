#include "train/exchange_thread.h"

#include <new>
#include <system_error>

#include "core/float_mode.h"
#include "core/parallel.h"

namespace splat::train {

Status ExchangeThread::start() {
    try {
        thread_ = std::thread([this] { run(); });
    } catch (const std::system_error&) {
        return no_thread("exchanging gradients");
    }
    return {};
}

ExchangeThread::~ExchangeThread() {
    if (!thread_.joinable()) return;
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    changed_.notify_all();
    thread_.join();
}

std::uint64_t ExchangeThread::post(std::function<Status()> call) {
    const std::lock_guard lock(mutex_);
    calls_.push_back(std::move(call));
    changed_.notify_all();
    return ++posted_;
}

Status ExchangeThread::wait(std::uint64_t number) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return done_ >= number; });
    return failed_;
}

void ExchangeThread::run() {
    const FloatMode mode;  // threads of Windows start in another one
    std::unique_lock lock(mutex_);
    while (true) {
        changed_.wait(lock, [this] { return stop_ || !calls_.empty(); });
        if (calls_.empty()) return;
        const std::function<Status()> call = std::move(calls_.front());
        calls_.pop_front();
        if (failed_.ok()) {
            lock.unlock();
            Status done(Code::kOutOfHostMemory, "no memory to exchange gradients");
            try {
                done = call();
            } catch (const std::bad_alloc&) {  // the status stays
            }
            lock.lock();
            failed_ = std::move(done);
        }
        ++done_;
        changed_.notify_all();
    }
}

}  // namespace splat::train

#include "vkrun/data/for_each_index.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

#include "vkrun/cli/progress.h"

namespace vkrun {
namespace {

/// What the threads of for_each_index share.
struct Shared {
    std::atomic<std::uint32_t> next{0};
    std::atomic<std::uint32_t> done{0};
    std::atomic<bool> failed{false};
    std::mutex mutex;
    std::exception_ptr failure;
};

void work_through(Shared& shared, std::uint32_t count,
                  const std::function<void(std::uint32_t)>& work) {
    while (!shared.failed) {
        const std::uint32_t index = shared.next++;
        if (index >= count) return;
        try {
            work(index);
            ++shared.done;
        } catch (...) {
            const std::lock_guard lock(shared.mutex);
            if (!shared.failed) shared.failure = std::current_exception();
            shared.failed = true;
        }
    }
}

}  // namespace

void for_each_index(const char* what, std::uint32_t count, std::uint32_t threads,
                    const std::function<void(std::uint32_t)>& work) {
    if (threads == 0) threads = std::max(1U, std::thread::hardware_concurrency());
    Shared shared;
    std::vector<std::thread> workers;
    try {
        for (std::uint32_t i = 0; i < std::min(threads, count); ++i)
            workers.emplace_back([&] { work_through(shared, count, work); });
    } catch (const std::system_error&) {  // no thread is left; the existing ones do the work
    }
    if (workers.empty()) {
        work_through(shared, count, work);
    } else {
        Progress progress(what, count);
        while (!shared.failed && shared.done < count) {
            progress.show(shared.done);
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
        }
    }
    for (std::thread& worker : workers) worker.join();
    if (shared.failure != nullptr) std::rethrow_exception(shared.failure);
}

}  // namespace vkrun

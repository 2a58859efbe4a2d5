#include "core/parallel.h"

#include <algorithm>
#include <atomic>
#include <future>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "core/float_mode.h"

namespace splat {

Status parallel_for(std::size_t count, std::size_t threads,
                    const std::function<Status(std::size_t)>& work) {
    using Failure = std::pair<std::size_t, Status>;  // index and error; index `count`: no error
    std::atomic<std::size_t> next = 0;
    const auto take_turns = [&]() -> Failure {
        const FloatMode mode;  // threads of Windows start in another one
        try {
            for (std::size_t i = next++; i < count; i = next++) {
                Status status = work(i);
                if (status.ok()) continue;
                next = count;
                return {i, std::move(status)};
            }
        } catch (...) {
            next = count;
            throw;
        }
        return {count, Status()};
    };
    threads = std::min({count, threads, std::size_t{std::thread::hardware_concurrency()}});
    std::vector<std::future<Failure>> others;
    try {
        for (std::size_t i = 1; i < threads; ++i)
            others.push_back(std::async(std::launch::async, take_turns));
    } catch (const std::system_error&) {  // no thread is left; the existing ones do the work
    }
    Failure first = take_turns();
    for (std::future<Failure>& other : others) {
        Failure failure = other.get();
        if (failure.first < first.first) first = std::move(failure);
    }
    return std::move(first.second);
}

bool can_start_thread() noexcept try {
    std::thread([] {}).join();
    return true;
} catch (...) {
    return false;
}

Status no_thread(const char* call) {
    return error(
        Code::kOutOfHostMemory,
        "%s: the system starts no more threads: a limit of the user (`ulimit -u`), of the "
        "container "
        "(pids.max, TasksMax) or of the machine is reached; end other programs, or raise it",
        call);
}

}  // namespace splat

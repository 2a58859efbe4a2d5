#pragma once

#include <cstddef>
#include <functional>

#include "core/status.h"

namespace splat {

/// More gain little for work bound by memory, such as reading a file of weights.
inline constexpr std::size_t kMostHostThreads = 4;

/// Call work(i) for each i < count, on this thread and others: at most `threads`, fewer if the CPU has
/// fewer or the system has none left. Threads take the next i in turn and stop after a failure, so that
/// the error is the one that a loop would return. Rethrows what work() throws, after all threads have
/// ended.
Status parallel_for(std::size_t count, std::size_t threads,
                    const std::function<Status(std::size_t)>& work);

/// False if the system starts no more threads for this process.
bool can_start_thread() noexcept;

/// The error of a call that needs one then.
Status no_thread(const char* call);

}  // namespace splat

#pragma once

#include <cstddef>
#include <functional>

#include "core/status.h"

namespace splat {

/// More gain little where memory is what takes the time, such as in reading a file of weights.
inline constexpr std::size_t kMostHostThreads = 4;

/// work(i) for each i < count, on this thread and on others: on `threads` at most, on fewer where the
/// CPU has fewer or the system none left. They take the next i in turn, and none after a failure, so
/// that the error is the one that a loop would return. What work() throws is thrown here; in every
/// case the other threads have ended.
Status parallel_for(std::size_t count, std::size_t threads,
                    const std::function<Status(std::size_t)>& work);

}  // namespace splat

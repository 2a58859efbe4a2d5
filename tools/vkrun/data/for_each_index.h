#pragma once

#include <cstdint>
#include <functional>

namespace vkrun {

/// Calls `work` for 0 to count - 1 from several threads (0: one for each core) under a progress bar, until
/// one throws; that exception is passed on.
void for_each_index(const char* what, std::uint32_t count, std::uint32_t threads,
                    const std::function<void(std::uint32_t)>& work);

}  // namespace vkrun

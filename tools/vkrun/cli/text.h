#pragma once

#include <string>

namespace vkrun {

/// printf into a string.
[[gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...);

/// "3.8 GiB"
std::string bytes_text(unsigned long long bytes);

}  // namespace vkrun

#pragma once

#include <string>

namespace vkrun {

/// printf into a string.
[[gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...);

/// "'PATH': SENTENCE", or the sentence alone if it names the path at its beginning.
std::string about_file(const std::string& path, const std::string& sentence);

/// "3.8 GiB"
std::string bytes_text(unsigned long long bytes);

}  // namespace vkrun

#pragma once

#include <string>
#include <vector>

namespace vkrun {

// mingw-w64 has two printf; C++ gets the one that knows %zu.
#if defined(__MINGW32__)
#define VKRUN_PRINTF gnu_printf
#else
#define VKRUN_PRINTF printf
#endif

/// printf into a string.
[[gnu::format(VKRUN_PRINTF, 1, 2)]] std::string format(const char* pattern, ...);

/// "'PATH': SENTENCE", or the sentence alone if it names the path at its beginning.
std::string about_file(const std::string& path, const std::string& sentence);

/// A field of a .csv, quoted where RFC 4180 asks for it.
std::string csv_field(const std::string& text);

/// "3.8 GiB"
std::string bytes_text(unsigned long long bytes);

/// The known word that `word` most likely means; empty if none is near.
std::string nearest_word(const std::string& word, const std::vector<std::string>& known);

/// "2 d 3 h", "3 h 12 min", "12 min" or "45 s"
std::string duration_text(double seconds);

}  // namespace vkrun

#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace splat {

/// Text of a file as messages show it: its first bytes, at most `most`, then "..."; control characters are '?'. No
/// UTF-8 sequence is cut.
std::string shown(std::string_view text, std::size_t most = 200);

}  // namespace splat

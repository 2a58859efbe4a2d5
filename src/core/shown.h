#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

namespace splat {

/// Text of a file as messages show it: its first bytes, at most `most`, then "..."; control characters are '?'. No
/// UTF-8 sequence is cut.
std::string shown(std::string_view text, std::size_t most = 200);

/// A list for a message: what `text` makes of each item, with ", " between them; empty texts have none before them.
template <class Range, class Text = std::identity>
std::string joined(const Range& items, Text text = {}) {
    std::string all;
    for (const auto& item : items) {
        if (!all.empty()) all += ", ";
        all += std::invoke(text, item);
    }
    return all;
}

}  // namespace splat

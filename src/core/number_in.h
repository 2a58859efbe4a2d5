#pragma once

#include <charconv>
#include <optional>
#include <string_view>

namespace splat {

/// The number that all of the text is; nothing if it is none.
template <class T>
std::optional<T> number_in(std::string_view text) {
    T value{};
    const char* const end = text.data() + text.size();
    const auto [stop, failed] = std::from_chars(text.data(), end, value);
    return failed == std::errc() && stop == end ? std::optional(value) : std::nullopt;
}

}  // namespace splat

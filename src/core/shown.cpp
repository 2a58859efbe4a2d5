#include "core/shown.h"

#include <algorithm>

namespace splat {

std::string shown(std::string_view text, std::size_t most) {
    constexpr std::size_t kMostContinued = 3;  // bytes of a UTF-8 sequence after its first
    const auto continues = [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U; };
    std::size_t end = std::min(text.size(), most);
    const std::size_t least = end - std::min(end, kMostContinued);
    if (end < text.size())
        while (end > least && continues(text[end])) --end;
    std::string kept(text.substr(0, end));
    const auto controls = [](unsigned char c) { return c < 0x20 || c == 0x7F; };
    std::ranges::replace_if(kept, controls, '?');
    return end < text.size() ? kept + "..." : kept;
}

}  // namespace splat

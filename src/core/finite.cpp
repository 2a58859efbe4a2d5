#include "core/finite.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace splat {
namespace {

constexpr std::size_t kBlock = 256;  ///< a constant, so that the compiler vectorises the loop

bool all_finite(std::span<const float, kBlock> values) {
    constexpr std::uint32_t kExponent = 0x7F800000;
    std::uint32_t bad = 0;
    for (const float value : values)
        bad |= (std::bit_cast<std::uint32_t>(value) & kExponent) == kExponent ? 1U : 0U;
    return bad == 0;
}

}  // namespace

std::size_t find_not_finite(std::span<const float> values) {
    std::size_t begin = 0;
    while (begin + kBlock <= values.size() && all_finite(values.subspan(begin).first<kBlock>()))
        begin += kBlock;
    const auto found =
        std::find_if(values.begin() + static_cast<std::ptrdiff_t>(begin), values.end(),
                     [](float value) { return !std::isfinite(value); });
    return static_cast<std::size_t>(found - values.begin());
}

}  // namespace splat

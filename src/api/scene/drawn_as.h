#pragma once

#include <cstdint>

#include "scene/gaussians.h"
#include "splat.h"

namespace splat::api {

/// A SPLAT_DRAWN_ bit, which is also the flag of a rasterizer, and what it means.
struct DrawnBit {
    constexpr DrawnBit(std::uint32_t drawn, std::uint32_t flag, bool scene::DrawnAs::*means)
        : bit(drawn == flag ? drawn : throw "a bit differs from its flag"), member(means) {}
    std::uint32_t bit;
    bool scene::DrawnAs::*member;
};
inline constexpr DrawnBit kDrawn[] = {
    {SPLAT_DRAWN_ANTIALIASED, SPLAT_RASTERIZER_ANTIALIASED, &scene::DrawnAs::antialiased},
    {SPLAT_DRAWN_BY_DISTANCE, SPLAT_RASTERIZER_SORT_BY_DISTANCE, &scene::DrawnAs::by_distance},
    {SPLAT_DRAWN_CUT_3_SIGMA, SPLAT_RASTERIZER_CUT_3_SIGMA, &scene::DrawnAs::three_sigma},
    {SPLAT_DRAWN_LINEAR_COLORS, SPLAT_RASTERIZER_LINEAR_COLORS, &scene::DrawnAs::linear_colors}};

inline constexpr std::uint32_t kDrawnBits = [] {
    std::uint32_t bits = 0;
    for (const DrawnBit& each : kDrawn) bits |= each.bit;
    return bits;
}();

inline std::uint32_t drawn_bits(const scene::DrawnAs& drawn_as) {
    std::uint32_t bits = 0;
    for (const DrawnBit& each : kDrawn) bits |= drawn_as.*each.member ? each.bit : 0;
    return bits;
}

/// Other bits are left out.
inline scene::DrawnAs drawn_as_of(std::uint32_t bits) {
    scene::DrawnAs drawn_as;
    for (const DrawnBit& each : kDrawn) drawn_as.*each.member = (bits & each.bit) != 0;
    return drawn_as;
}

}  // namespace splat::api

#pragma once

#include <array>
#include <cstdint>

#include "io/bytes.h"

namespace splat::io::spz {

inline constexpr std::uint32_t kSpzMagic = 0x5053474E;  ///< "NGSP"
inline constexpr std::size_t kHeaderBytes = 16;         ///< versions 1 to 3
inline constexpr std::size_t kHeader4Bytes = 32;        ///< version 4: more fields, then zeros
inline constexpr std::uint8_t kAntialiased = 1;         ///< flags
inline constexpr std::uint8_t kExtensions = 2;
inline constexpr std::uint8_t kMaxDegree = 4;
inline constexpr std::uint8_t kMaxFractionBits = 24;

inline constexpr double kColorScale = 0.15;  ///< byte = 255 (0.5 + 0.15 sh[0])
inline constexpr double kSqrtHalf = 0.70710678118654752;

struct Header {
    std::uint32_t version = 0;
    std::uint32_t count = 0;
    std::uint8_t degree = 0;
    std::uint8_t fraction_bits = 0;
    std::uint8_t flags = 0;
    std::uint8_t streams = 0;  ///< version 4
};

/// The arrays, in the order of the file.
enum Array : std::size_t { kMeans, kOpacities, kColors, kScales, kRotations, kSh, kArrays };

/// Bytes for each Gaussian of each array.
inline std::array<std::size_t, kArrays> bytes_each(const Header& header) {
    const std::size_t degree = header.degree;
    return {
        header.version == 1 ? std::size_t{6} : 9, 1, 3, 3, header.version >= 3 ? std::size_t{4} : 3,
        3 * ((degree + 1) * (degree + 1) - 1)};
}

}  // namespace splat::io::spz

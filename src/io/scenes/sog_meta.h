#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/status.h"
#include "io/bytes.h"
#include "io/scenes/sog_codebook.h"

namespace splat::io {

/// The images of a .sog file.
enum SogImage : std::size_t {
    kSogMeansLow,
    kSogMeansHigh,
    kSogQuats,
    kSogScales,
    kSogColors,
    kSogCentroids,  ///< the palette of harmonics; the labels are its entries
    kSogLabels,
    kSogImages
};

/// Their names as others write them.
inline constexpr std::array<const char*, kSogImages> kSogNames = {
    "means_l.webp", "means_u.webp",       "quats.webp",     "scales.webp",
    "sh0.webp",     "shN_centroids.webp", "shN_labels.webp"};

inline constexpr std::size_t kSogPaletteWidth = 64;  ///< entries of a row of the centroids

/// What the meta.json of a .sog file says, of either version.
struct SogMeta {
    std::uint32_t version = 2;
    std::uint64_t count = 0;
    bool antialiased = false;
    std::array<double, 3> mins{}, maxs{};  ///< bounds of sign(x) ln(1 + |x|), positions x
    std::array<Codebook, 3> scales{};
    std::array<Codebook, 3> colors{};
    Codebook opacity_logits{};
    std::uint64_t palette = 0;  ///< entries; 0: no harmonics
    std::uint32_t degree = 0;   ///< SH degree; version 1 leaves it to the width of the centroids
    Codebook harmonics{};
    std::array<std::string, kSogImages> files;  ///< empty: none
    std::vector<std::string> ignored;           ///< members without a meaning here

    [[nodiscard]] bool has_harmonics() const { return !files[kSogCentroids].empty(); }
};

/// Errors: kFormat, naming the member; kUnsupported for another version. Source: PlayCanvas, SOG format specification.
Result<SogMeta> parse_sog_meta(Bytes text);

/// The text of a version 2 file, with the first codebooks of scales and colours.
std::string write_sog_meta(const SogMeta& meta);

}  // namespace splat::io

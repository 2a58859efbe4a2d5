#include "io/photo/photo.h"

#include <cmath>
#include <optional>
#include <string_view>

namespace splat::io {
namespace {

constexpr std::size_t kTiffHeader = 8;  ///< "II" or "MM", 42, where the first directory starts
constexpr std::size_t kEntryBytes = 12;

enum Tag : std::uint32_t {
    kOrientation = 274,
    kExifDirectory = 34665,
    kFocalLength = 37386,     ///< mm
    kFocalPlaneX = 41486,     ///< pixels in a unit of the sensor's width
    kFocalPlaneUnit = 41488,  ///< 2 inch, 3 cm
    kFocalLength35 = 41989  ///< mm, of a film of 36 x 24 mm with the same angle across the diagonal
};

enum Type : std::uint32_t { kShort = 3, kLong = 4, kRational = 5 };

/// Unsigned numbers of either byte order; the bytes may end too early.
struct Tiff {
    Bytes bytes;
    bool little = false;

    [[nodiscard]] std::optional<std::uint32_t> number(std::size_t at, std::size_t size) const {
        if (at > bytes.size() || bytes.size() - at < size) return std::nullopt;
        std::uint32_t value = 0;
        for (std::size_t i = 0; i < size; ++i)
            value = value << 8U |
                    std::to_integer<std::uint32_t>(bytes[at + (little ? size - 1 - i : i)]);
        return value;
    }
};

/// An entry of a directory, where it is there and of this type: a number, or the place of a fraction.
std::optional<std::uint32_t> entry(const Tiff& tiff, std::uint32_t directory, Tag tag, Type type) {
    const auto count = tiff.number(directory, 2);
    if (directory < kTiffHeader || !count) return std::nullopt;
    for (std::size_t i = 0; i < *count; ++i) {
        const std::size_t at = std::size_t{directory} + 2 + i * kEntryBytes;
        if (tiff.number(at, 2) == tag && tiff.number(at + 2, 2) == type)
            return tiff.number(at + 8, type == kShort ? 2 : 4);
    }
    return std::nullopt;
}

/// 0 if it is not there.
double fraction(const Tiff& tiff, std::uint32_t directory, Tag tag) {
    const auto at = entry(tiff, directory, tag, kRational);
    const auto above = at ? tiff.number(*at, 4) : std::nullopt;
    const auto below = at ? tiff.number(std::size_t{*at} + 4, 4) : std::nullopt;
    return above && below && *below != 0 ? static_cast<double>(*above) / *below : 0;
}

double focal_of(const Tiff& tiff, std::uint32_t directory, double diagonal) {
    const auto film = entry(tiff, directory, kFocalLength35, kShort);
    if (film && *film != 0) return *film * diagonal / std::hypot(36, 24);
    const auto unit = entry(tiff, directory, kFocalPlaneUnit, kShort).value_or(2);
    const double millimetres = unit == 2 ? 25.4 : unit == 3 ? 10 : 0;
    if (millimetres == 0) return 0;
    return fraction(tiff, directory, kFocalLength) * fraction(tiff, directory, kFocalPlaneX) /
           millimetres;
}

Exif facts_of(Tiff tiff, double diagonal) {
    const auto order = tiff.number(0, 2);
    if (order != 0x4949U && order != 0x4D4DU) return {};
    tiff.little = order == 0x4949U;
    const auto directory = tiff.number(4, 4);
    if (tiff.number(2, 2) != 42U || !directory) return {};
    Exif facts;
    const auto noted = entry(tiff, *directory, kOrientation, kShort);
    if (noted && *noted >= 1 && *noted <= 8) facts.orientation = *noted;
    if (const auto below = entry(tiff, *directory, kExifDirectory, kLong))
        facts.focal = focal_of(tiff, *below, diagonal);
    return facts;
}

}  // namespace

Exif exif_of(Bytes jpeg, std::uint32_t width, std::uint32_t height) {
    constexpr std::string_view kExif("Exif\0\0", 6);
    const Tiff file{jpeg};
    // Segments follow each other: FF, marker, length with its own two bytes; FF DA starts the pixels.
    for (std::size_t at = 2;;) {
        const auto marker = file.number(at, 2);
        if (marker == 0xFFFFU) {  // a fill byte
            ++at;
            continue;
        }
        const auto length = file.number(at + 2, 2);
        if (!marker || !length || *marker >> 8U != 0xFFU || *marker == 0xFFDAU || *length < 2 ||
            jpeg.size() - at - 2 < *length)
            return {};
        const Bytes segment = jpeg.subspan(at + 4, *length - 2);
        if (*marker == 0xFFE1U && as_text(segment).starts_with(kExif))
            return facts_of({segment.subspan(kExif.size())}, std::hypot(width, height));
        at += 2 + *length;
    }
}

Image upright(Image image, std::uint32_t orientation) {
    if (orientation <= 1 || orientation > 8) return image;
    // Where the first stored row and column lie in the scene: 2 top right, 3 bottom right, 4 bottom left,
    // 5 left top, 6 right top, 7 right bottom, 8 left bottom.
    const bool transposed = orientation >= 5;
    const bool from_right = orientation == 2 || orientation == 3 || orientation >= 7;
    const bool from_below =
        orientation == 3 || orientation == 4 || orientation == 6 || orientation == 7;
    Image out = image;
    if (transposed) std::swap(out.width, out.height);
    std::size_t at = 0;
    for (std::uint32_t y = 0; y < out.height; ++y)
        for (std::uint32_t x = 0; x < out.width; ++x) {
            std::uint32_t column = transposed ? y : x;
            std::uint32_t row = transposed ? x : y;
            if (from_right) column = image.width - 1 - column;
            if (from_below) row = image.height - 1 - row;
            const std::size_t from = (std::size_t{row} * image.width + column) * image.channels;
            for (std::uint32_t c = 0; c < image.channels; ++c)
                out.samples[at++] = image.samples[from + c];
        }
    return out;
}

}  // namespace splat::io

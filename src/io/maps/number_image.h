#pragma once

#include <string>

#include "core/status.h"
#include "io/bytes.h"

namespace splat::io {

/// An image of numbers.
struct NumberImage {
    std::uint32_t width = 0, height = 0, channels = 0;
    std::uint32_t bits =
        0;  ///< 8 or 16: whole numbers, as a PNG file of so many bits holds; 0: others
    std::vector<float> values;  ///< [height,width,channels]
};

/// The extension is .npy or .pfm, in any case.
bool is_number_name(const std::string& path);

/// The first bytes are those of .npy or of PFM.
bool is_number_image(Bytes file);

/// What is read of a file.
enum class NumberPart {
    kHeader,  ///< all but the values, of the first 4096 bytes; errors are those that the header shows
    kSize,    ///< all but the values, of the whole file
    kValues
};

/// Reads a PFM file or a .npy array [height,width], [height,width,channels] or [channels,height,width] of 1 to 4
/// channels and any type that read_npy() reads. Where the last axis may be that of channels, it is.
///
/// Errors       as read_npy() and read_pfm(); kUnsupported for other shapes
Result<NumberImage> read_number_image(Bytes file, NumberPart part = NumberPart::kValues);

}  // namespace splat::io

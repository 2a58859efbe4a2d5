#pragma once

#include "io/image.h"

namespace splat::io {

/// A binary PGM (P5) or PPM (P6) file, as gray or RGB. Up to a greatest value of 255 the samples have 8 bits, else 16;
/// other greatest values than 255 and 65535 are scaled to those.
///
/// Errors       kFormat if it is not such a file, damaged, truncated, longer than its size, or has samples above
///              its greatest value; as check_header()
/// Source       Netpbm's documentation, "pgm" and "ppm"
Result<Image> read_netpbm(Bytes file, const ImageOptions& options = {});

/// The header of a PFM file.
struct PfmHeader {
    std::uint32_t width = 0, height = 0, channels = 0;  ///< gray (Pf): 1 channel, colours (PF): 3
    std::endian order = std::endian::little;
    std::size_t start = 0;  ///< byte offset of the numbers in the file
};

/// Errors: kFormat.
Result<PfmHeader> read_pfm_header(Bytes file);

/// Where its numbers lie. Errors: as read_pfm_numbers().
Result<Bytes> pfm_data(Bytes file, const PfmHeader& header);

/// Reads the numbers [height,width,channels] from the top row on, which the file holds last. Errors: kFormat if they
/// are truncated or more follows. Source: Debevec, "PFM Portable FloatMap Image Format"
Result<std::vector<float>> read_pfm_numbers(Bytes file, const PfmHeader& header);

}  // namespace splat::io

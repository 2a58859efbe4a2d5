#pragma once

#include "io/image.h"
#include "io/maps/number_image.h"

namespace splat::io {

/// A binary PGM (P5) or PPM (P6) file, as gray or RGB. Up to a greatest value of 255 the samples have 8 bits, else 16;
/// other greatest values than 255 and 65535 are scaled to those.
///
/// Errors       kFormat if it is not such a file, damaged, truncated, longer than its size, or has samples above
///              its greatest value; as check_header()
/// Source       Netpbm's documentation, "pgm" and "ppm"
Result<Image> read_netpbm(Bytes file, const ImageOptions& options = {});

/// A PFM file, whose rows lie from the lowest up. Errors: kFormat if it is damaged, or its numbers are truncated or
/// more follows. Source: Debevec, "PFM Portable FloatMap Image Format"
Result<NumberImage> read_pfm(Bytes file, NumberPart part);

}  // namespace splat::io

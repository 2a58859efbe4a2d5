#pragma once

#include "core/decode_budget.h"
#include "core/status.h"
#include "io/bytes.h"

namespace splat::io {

/// What a bit stream of lossless WebP says before its pixels.
struct LosslessHead {
    std::uint32_t groups = 1;  ///< groups of prefix codes
    std::uint32_t cache_bits =
        0;                      ///< the colour cache holds 2^cache_bits colours; 0: there is none
    std::uint32_t width = 0;    ///< pixels that are stored for each row; packed ones count once
    bool only_palette = false;  ///< no other transform
    bool only_green = true;     ///< no prefix code of red, blue or alpha takes bits
    std::uint64_t bits = 0;     ///< where the pixels begin
};

/// Reads the transforms, the entropy image and all prefix codes of an image of width x height pixels, in a stream
/// that begins `skip_bits` behind the start of `stream`. Takes what libwebp keeps of them from the budget before it
/// reads on. Time is linear in the stream and what was taken. Source: RFC 9649, sections 3.5 to 3.7.
/// Errors: kFormat if libwebp would call the stream damaged, too; as DecodeBudget::take()
Result<LosslessHead> read_lossless_head(Bytes stream, std::uint64_t skip_bits, std::uint32_t width,
                                        std::uint32_t height, DecodeBudget& budget);

}  // namespace splat::io

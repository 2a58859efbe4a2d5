#pragma once

#include "io/apng.h"

namespace splat::io {

/// Longest side of a GIF.
inline constexpr std::uint32_t kMaxGifSide = 65535;

/// An animated GIF of frames of the same size, gray or RGB of 8 bits. Gray is kept; RGB becomes the
/// nearest of 6 x 7 x 6 colours after an ordered dither of 8 x 8 pixels, so that a still pixel stays
/// still. Times are rounded to 1/100 s, at least 2/100 s, because browsers play shorter ones slowly.
/// Determinism: the same bytes for the same frames and the same giflib.
///
/// Errors       kInvalidArgument as write_apng; kUnsupported for an alpha channel or a longer side
/// Precision    each channel within one step (255/5, green 255/6) of the frame
/// Source       GIF89a; the pattern is Bayer 1973
Result<Buffer> write_gif(const std::vector<Image>& frames, const AnimationOptions& options = {});

}  // namespace splat::io

#pragma once

#include "io/image.h"

namespace splat::io {

struct AnimationOptions {
    std::uint32_t milliseconds = 50;  ///< for each frame; 1 to 65535
    std::uint32_t repeats = 0;        ///< times it plays; 0: for ever
};

/// Errors: kInvalidArgument for no frame, frames that differ in size, 16 bits, or a time out of
/// range.
Status check_frames(const std::vector<Image>& frames, const AnimationOptions& options);

/// An animated PNG of frames of the same size and channels, 8 bits. Programs without support for
/// animations show the first frame. Determinism: the same bytes for the same frames, libpng and zlib.
///
/// Errors       those of check_frames
/// Source       Animated PNG, W3C Portable Network Graphics (third edition), section 11.3.2
Result<Buffer> write_apng(const std::vector<Image>& frames, const AnimationOptions& options = {});

/// Longest side of a GIF.
inline constexpr std::uint32_t kMaxGifSide = 65535;

/// An animated GIF of frames of the same size, gray or RGB of 8 bits. Gray is kept; RGB becomes the
/// nearest of 6 x 7 x 6 colours after an ordered dither of 8 x 8 pixels, so that a still pixel stays
/// still. Times are rounded to 1/100 s, at least 2/100 s, because browsers play shorter ones slowly.
/// Determinism: the same bytes for the same frames and the same giflib.
///
/// Errors       kInvalidArgument as check_frames; kUnsupported for an alpha channel or a longer side
/// Precision    each channel within one step (255/5, green 255/6) of the frame
/// Source       GIF89a; the pattern is Bayer 1973
Result<Buffer> write_gif(const std::vector<Image>& frames, const AnimationOptions& options = {});

/// Longest side of a WebP.
inline constexpr std::uint32_t kMaxWebpSide = 16383;

/// An animated WebP without loss of frames of the same size and channels, 8 bits; gray becomes RGB.
/// Determinism: the same bytes for the same frames and the same libwebp.
///
/// Errors       kInvalidArgument as check_frames; kUnsupported for a longer side
/// Precision    the samples of the frames
/// Source       WebP Container Specification, animation
Result<Buffer> write_webp_animation(const std::vector<Image>& frames,
                                    const AnimationOptions& options = {});

}  // namespace splat::io

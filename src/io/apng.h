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
/// animations show the first frame. Determinism: the same bytes for the same frames and the same zlib.
///
/// Errors       those of check_frames
/// Source       Animated PNG, W3C Portable Network Graphics (third edition), section 11.3.2
Result<Buffer> write_apng(const std::vector<Image>& frames, const AnimationOptions& options = {});

}  // namespace splat::io

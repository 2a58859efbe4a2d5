#pragma once

#include "io/apng.h"

namespace splat::io {

/// Longest side of a WebP.
inline constexpr std::uint32_t kMaxWebpSide = 16383;

/// An animated WebP without loss of frames of the same size and channels, 8 bits; gray becomes RGB.
/// Determinism: the same bytes for the same frames and the same libwebp.
///
/// Errors       kInvalidArgument as write_apng; kUnsupported for a longer side
/// Precision    the samples of the frames
/// Source       WebP Container Specification, animation
Result<Buffer> write_webp_animation(const std::vector<Image>& frames,
                                    const AnimationOptions& options = {});

}  // namespace splat::io

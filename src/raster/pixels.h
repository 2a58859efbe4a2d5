#pragma once

#include "vk/recorder.h"

namespace splat::raster {

/// Four numbers a pixel, without gaps.
enum class PixelFormat : int { kBytes, kHalves, kFloats };

constexpr std::uint32_t pixel_bytes(PixelFormat format) {
    return format == PixelFormat::kBytes ? 4 : format == PixelFormat::kHalves ? 8 : 16;
}

/// Convert `count` pixels. Bytes are 255 v rounded and clamped, exactly as of io::to_byte; halves are rounded as the
/// device does.
///
/// image   [count] quads
/// pixels  [count] of pixel_bytes(), rounded up to whole quads
Status raster_pixels(vk::Recorder& recorder, PixelFormat format, std::uint64_t count,
                     const vk::BufferView& image, const vk::BufferView& pixels);

}  // namespace splat::raster

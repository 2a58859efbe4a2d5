#pragma once

#include <span>

#include "io/image.h"

namespace splat::io {

/// A JPEG file, baseline or progressive, as gray or RGB. Values are as stored; options.upright turns
/// it by its Exif orientation.
///
/// Errors       kFormat if it is not a JPEG, damaged (libjpeg's sentence) or truncated; kUnsupported
///              above the limits and for CMYK
/// Precision    the integer transform of libjpeg-turbo; other decoders may differ by 1 or 2
Result<Image> read_jpeg(Bytes file, const ImageOptions& options = {});

/// A WebP file, lossy or lossless, as RGB, or RGBA if it has an alpha channel.
///
/// Memory       the decode budget holds the samples, 6 or 8 bytes a pixel. On top of it libwebp takes up to 5 bytes a
///              pixel, of at most 16,383 x 16,383, and up to 1.4 GB for the prefix codes of a lossless stream: at most
///              65,536 groups of 5 to 21 KB. A code of many symbols may take a few bits, and no header tells their
///              number, so neither the file's size nor its header bounds them further
/// Errors       kFormat if it is not a WebP, damaged or truncated; kUnsupported for animations;
///              as check_header()
Result<Image> read_webp(Bytes file, const ImageOptions& options = {});

/// The longest side of a WebP image.
inline constexpr std::uint32_t kLongestWebpSide = 16383;

/// A lossless WebP file of [height,width,4] bytes, which keep their values below alpha 0, too. Determinism: the same
/// bytes for one version of libwebp. Errors: kInvalidArgument if the length or a side does not fit.
Result<Buffer> write_webp(std::span<const std::uint8_t> rgba, std::uint32_t width,
                          std::uint32_t height);

/// What the Exif segment of a JPEG file says, where it is there and not damaged.
struct Exif {
    std::uint32_t orientation = 1;  ///< 1 (upright) to 8
    /// Pixels; 0: not known. From the focal length for 35 mm film, whose diagonal sees the same angle;
    /// else from the focal length and the sensor's pixels per inch or cm.
    double focal = 0;
};

/// Exif data of an image of width x height pixels. Source: CIPA DC-008, tags 274, 37386, 41486, 41488, 41989.
Exif exif_of(Bytes jpeg, std::uint32_t width, std::uint32_t height);

/// The image with rows and columns reordered so that it is upright.
Image upright(Image image, std::uint32_t orientation);

}  // namespace splat::io

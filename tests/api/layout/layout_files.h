// The structs of files of images, weights and cameras, and of their limits.
#pragma once

#include "api/layout/layout.h"

namespace splat::test {

inline const Layout kImageInfo = {  // clang-format off
    "splat_image_info",
    sizeof(splat_image_info),
    16,
    {
    SPLAT_FIELD(splat_image_info, struct_size, 0, 4),
    SPLAT_FIELD(splat_image_info, bits, 4, 4),
    SPLAT_FIELD(splat_image_info, focal, 8, 8),}
};  // clang-format on

inline const Layout kDecodeLimits = {  // clang-format off
    "splat_decode_limits",
    sizeof(splat_decode_limits),
    48,
    {
    SPLAT_FIELD(splat_decode_limits, struct_size, 0, 4),
    SPLAT_FIELD(splat_decode_limits, flags, 4, 4),
    SPLAT_FIELD(splat_decode_limits, next, 8, 8),
    SPLAT_FIELD(splat_decode_limits, bytes_times_file, 16, 8),
    SPLAT_FIELD(splat_decode_limits, bytes_besides, 24, 8),
    SPLAT_FIELD(splat_decode_limits, items, 32, 8),
    SPLAT_FIELD(splat_decode_limits, jpeg_scans, 40, 4),
    SPLAT_FIELD(splat_decode_limits, reserved, 44, 4),}
};  // clang-format on

inline const Layout kNamedArray = {  // clang-format off
    "splat_named_array",
    sizeof(splat_named_array),
    96,
    {
    SPLAT_FIELD(splat_named_array, name, 0, 8),
    SPLAT_FIELD(splat_named_array, values, 8, 8),
    SPLAT_FIELD(splat_named_array, value_count, 16, 8),
    SPLAT_FIELD(splat_named_array, dims, 24, 64),
    SPLAT_FIELD(splat_named_array, rank, 88, 4),
    SPLAT_FIELD(splat_named_array, reserved, 92, 4),}
};  // clang-format on

inline const Layout kCameraBytes = {  // clang-format off
    "splat_camera_bytes",
    sizeof(splat_camera_bytes),
    40,
    {
    SPLAT_FIELD(splat_camera_bytes, struct_size, 0, 4),
    SPLAT_FIELD(splat_camera_bytes, reserved, 4, 4),
    SPLAT_FIELD(splat_camera_bytes, cameras, 8, 8),
    SPLAT_FIELD(splat_camera_bytes, camera_bytes, 16, 8),
    SPLAT_FIELD(splat_camera_bytes, images, 24, 8),
    SPLAT_FIELD(splat_camera_bytes, image_bytes, 32, 8),}
};  // clang-format on

}  // namespace splat::test

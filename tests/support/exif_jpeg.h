#pragma once

#include <stddef.h>
#include <stdio.h>

#include <jpeglib.h>

#include <cstdint>
#include <cstdlib>
#include <vector>

namespace splat::test {

/// A gray JPEG file of 12 x 8 pixels; `millimetres` of 35 mm film in its Exif data, 0: none.
inline std::vector<std::byte> exif_jpeg(std::uint8_t millimetres) {
    jpeg_compress_struct jpeg{};
    jpeg_error_mgr errors{};
    jpeg.err = jpeg_std_error(&errors);
    jpeg_create_compress(&jpeg);
    unsigned char* bytes = nullptr;
    unsigned long size = 0;
    jpeg_mem_dest(&jpeg, &bytes, &size);
    jpeg.image_width = 12;
    jpeg.image_height = 8;
    jpeg.input_components = 1;
    jpeg.in_color_space = JCS_GRAYSCALE;
    jpeg_set_defaults(&jpeg);
    jpeg_start_compress(&jpeg, TRUE);
    // "MM", 42, first directory at 8: one entry, Exif's directory at 26; there FocalLengthIn35mmFilm.
    const std::uint8_t exif[] = {'E', 'x', 'i', 'f',  0,           0, 'M', 'M', 0,    42, 0, 0, 0,
                                 8,   0,   1,   0x87, 0x69,        0, 4,   0,   0,    0,  1, 0, 0,
                                 0,   26,  0,   0,    0,           0, 0,   1,   0xA4, 5,  0, 3, 0,
                                 0,   0,   1,   0,    millimetres, 0, 0,   0,   0,    0,  0};
    if (millimetres != 0) jpeg_write_marker(&jpeg, JPEG_APP0 + 1, exif, sizeof exif);
    unsigned char row[12] = {0, 20, 40, 60, 80, 100, 120, 140, 160, 180, 200, 220};
    for (JSAMPROW at = row; jpeg.next_scanline < jpeg.image_height;)
        jpeg_write_scanlines(&jpeg, &at, 1);
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
    const auto* const first = reinterpret_cast<const std::byte*>(bytes);
    std::vector<std::byte> file(first, first + size);
    std::free(bytes);
    return file;
}

}  // namespace splat::test

#pragma once

#include <stddef.h>
#include <stdio.h>

#include <jpeglib.h>

#include <cstdint>
#include <cstdlib>
#include <vector>

namespace splat::test {

struct JpegOptions {
    int channels = 1;
    J_COLOR_SPACE space = JCS_GRAYSCALE;
    bool progressive = false;
    int quality = 100;
    std::vector<std::uint8_t> exif;  ///< the content of APP1; empty: none
};

/// A JPEG file of packed samples.
inline std::vector<std::byte> sample_jpeg(std::vector<std::uint8_t> samples, JDIMENSION width,
                                          JDIMENSION height, const JpegOptions& options) {
    jpeg_compress_struct jpeg{};
    jpeg_error_mgr errors{};
    jpeg.err = jpeg_std_error(&errors);
    jpeg_create_compress(&jpeg);
    unsigned char* bytes = nullptr;
    unsigned long size = 0;
    jpeg_mem_dest(&jpeg, &bytes, &size);
    jpeg.image_width = width;
    jpeg.image_height = height;
    jpeg.input_components = options.channels;
    jpeg.in_color_space = options.space;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, options.quality, TRUE);
    if (options.progressive) jpeg_simple_progression(&jpeg);
    jpeg_start_compress(&jpeg, TRUE);
    if (!options.exif.empty())
        jpeg_write_marker(&jpeg, JPEG_APP0 + 1, options.exif.data(),
                          static_cast<unsigned>(options.exif.size()));
    const std::size_t row_bytes = std::size_t{width} * static_cast<std::size_t>(options.channels);
    while (jpeg.next_scanline < height) {
        JSAMPROW row = &samples[jpeg.next_scanline * row_bytes];
        jpeg_write_scanlines(&jpeg, &row, 1);
    }
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
    const auto* const first = reinterpret_cast<const std::byte*>(bytes);
    std::vector<std::byte> file(first, first + size);
    std::free(bytes);
    return file;
}

/// A gray JPEG file of 12 x 8 pixels; `millimetres` of 35 mm film in its Exif data, 0: none.
inline std::vector<std::byte> exif_jpeg(std::uint8_t millimetres) {
    JpegOptions options;
    // "MM", 42, first directory at 8: one entry, Exif's directory at 26; there FocalLengthIn35mmFilm.
    if (millimetres != 0)
        options.exif = {'E', 'x', 'i', 'f',  0,           0, 'M', 'M', 0,    42, 0, 0, 0,
                        8,   0,   1,   0x87, 0x69,        0, 4,   0,   0,    0,  1, 0, 0,
                        0,   26,  0,   0,    0,           0, 0,   1,   0xA4, 5,  0, 3, 0,
                        0,   0,   1,   0,    millimetres, 0, 0,   0,   0,    0,  0};
    return sample_jpeg(std::vector<std::uint8_t>(12 * 8, 100), 12, 8, options);
}

}  // namespace splat::test

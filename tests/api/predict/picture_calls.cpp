#include "api/predict/picture_calls.h"

namespace splat::test {

std::vector<std::uint8_t> picture_bytes(std::uint32_t channels) {
    std::vector<std::uint8_t> bytes;
    for (std::uint32_t y = 0; y < 24; ++y)
        for (std::uint32_t x = 0; x < 32; ++x) {
            const bool inside = x >= 8 && x < 20 && y >= 6 && y < 15;
            for (std::uint32_t c = 0; c < channels; ++c) {
                const bool alpha = channels % 2 == 0 && c + 1 == channels;
                const auto dark = static_cast<std::uint8_t>(5 * (x - 8) + 4 * (y - 6) + c);
                const std::uint8_t ground = alpha ? 0 : 230;
                bytes.push_back(!inside ? ground : alpha ? std::uint8_t{255} : dark);
            }
        }
    return bytes;
}

PictureFile::PictureFile(std::uint32_t channels) : path_(".png") {
    const std::vector<std::uint8_t> bytes = picture_bytes(channels);
    const splat_image image = image_of(bytes, channels);
    EXPECT_DONE(splat_image_save(path(), &image));
}

}  // namespace splat::test

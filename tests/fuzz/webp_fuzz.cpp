// WebP: any bytes give an error or a valid image, whose header alone says the same.

#include "fuzz/target.h"
#include "io/photo/photo.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    io::ImageOptions options = {256, 1U << 18U};  // libwebp makes 20 KB for each 4 x 4 pixels
    const auto image = io::read_webp(file, options);
    options.header_only = true;
    const auto header = io::read_webp(file, options);
    if (!fuzz::accepted(image.status())) return;
    fuzz::require(io::check_image(image.value()).ok());
    fuzz::require(header.ok() && header.value().samples.empty());
    fuzz::require(header.value().width == image.value().width &&
                  header.value().height == image.value().height &&
                  header.value().channels == image.value().channels);
}

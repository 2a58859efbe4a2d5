// JPEG: any bytes give an error or a valid image, whose header alone says the same.

#include "fuzz/target.h"
#include "io/photo/photo.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    io::ImageOptions options = {512, 1U << 20U};
    options.upright = true;
    const auto image = io::read_jpeg(file, options);
    options.header_only = true;
    const auto header = io::read_jpeg(file, options);
    if (!fuzz::accepted(image.status())) return;
    fuzz::require(io::check_image(image.value()).ok());
    fuzz::require(header.ok() && header.value().samples.empty());
    fuzz::require(header.value().width == image.value().width &&
                  header.value().height == image.value().height &&
                  header.value().channels == image.value().channels);
}

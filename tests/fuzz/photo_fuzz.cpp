// JPEG and WebP: any bytes give an error or a valid image. The corpus was written by libjpeg-turbo and
// libwebp.

#include "fuzz/target.h"
#include "io/photo/image_file.h"
#include "io/photo/jpeg.h"
#include "io/photo/webp.h"

namespace {

using namespace splat;

const io::ImageOptions kSmall = {512, 1U << 20U};

void check(io::Bytes file) {
    for (const auto& image : {io::read_jpeg(file, kSmall), io::read_webp(file, kSmall)})
        if (fuzz::accepted(image.status())) fuzz::require(io::check_image(image.value()).ok());
    io::ImageOptions options = kSmall;
    options.upright = true;
    const auto image = io::read_image(file, options);
    options.header_only = true;
    const auto header = io::read_image(file, options);
    if (!fuzz::accepted(image.status())) return;
    fuzz::require(header.ok() && header.value().samples.empty());
    fuzz::require(header.value().width == image.value().width &&
                  header.value().height == image.value().height &&
                  header.value().channels == image.value().channels);
}

}  // namespace

SPLAT_FUZZ_TARGET(check)

// JPEG and WebP: any bytes give an error or a valid image. The corpus was written by libjpeg-turbo and
// libwebp.

#include "fuzz/target.h"
#include "io/photo/jpeg.h"
#include "io/photo/webp.h"

namespace {

using namespace splat;

constexpr io::ImageOptions kSmall = {512, 1U << 20U};

void check(io::Bytes file) {
    for (const auto& image : {io::read_jpeg(file, kSmall), io::read_webp(file, kSmall)})
        if (image.ok()) fuzz::require(io::check_image(image.value()).ok());
}

}  // namespace

SPLAT_FUZZ_TARGET(check)

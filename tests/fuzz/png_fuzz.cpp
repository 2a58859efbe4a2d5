// PNG: what is accepted can be written, where the writer has the type, and read again.

#include "fuzz/checksums.h"
#include "fuzz/target.h"
#include "io/image.h"

using namespace splat;

namespace {

const io::ImageOptions kSmall = {512, 1U << 20U};

}  // namespace

SPLAT_FUZZ_TARGET(io::Bytes file) {
    const auto image = io::read_png(file, kSmall);
    if (!fuzz::accepted(image.status())) return;
    fuzz::require(io::check_image(image.value()).ok());
    const auto written = io::write_png(image.value());
    if (!written.ok()) return;
    const auto again = io::read_png(written.value(), kSmall);
    fuzz::require(again.ok() && again.value().samples == image.value().samples);
}

SPLAT_FUZZ_MUTATOR(fuzz::repair_png)

// PNG: what is accepted can be written, where the writer has the type, and read again.

#include "fuzz/checksums.h"
#include "fuzz/target.h"
#include "io/image.h"

namespace {

using namespace splat;

const io::ImageOptions kSmall = {512, 1U << 20U};

void check(io::Bytes file) {
    const auto image = io::read_png(file, kSmall);
    if (!fuzz::accepted(image.status())) return;
    fuzz::require(io::check_image(image.value()).ok());
    const auto written = io::write_png(image.value());
    if (!written.ok()) return;
    const auto again = io::read_png(written.value(), kSmall);
    fuzz::require(again.ok() && again.value().samples == image.value().samples);
}

}  // namespace

SPLAT_FUZZ_TARGET(check)
SPLAT_FUZZ_MUTATOR(fuzz::repair_png)

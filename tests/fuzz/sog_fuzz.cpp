// .sog: what is accepted can be written and read again.

#include "fuzz/checksums.h"
#include "fuzz/target.h"
#include "io/scene_formats.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    io::LoadOptions options = fuzz::small_scenes();
    options.limits = {64, 4U << 20U, 1000};  // libwebp makes 20 KB for each 4 x 4 pixels
    const auto loaded = io::read_sog(file, options);
    if (!fuzz::accepted(loaded.status())) return;
    fuzz::check_scene(loaded.value());
    const auto written = io::write_sog(loaded.value().gaussians);
    if (written.ok()) fuzz::require(io::read_sog(written.value(), fuzz::small_scenes()).ok());
}

SPLAT_FUZZ_MUTATOR(fuzz::repair_zip)

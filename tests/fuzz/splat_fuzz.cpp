#include "fuzz/target.h"
#include "io/scene_formats.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    const auto loaded = io::read_splat(file, fuzz::small_scenes());
    if (!fuzz::accepted(loaded.status())) return;
    fuzz::check_scene(loaded.value());
    const auto written = io::write_splat(loaded.value().gaussians);
    if (written.ok()) fuzz::require(written.value().size() == file.size());
}

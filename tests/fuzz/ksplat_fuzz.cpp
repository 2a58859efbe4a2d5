// .ksplat: what is accepted can be written as .ply, and read again.

#include "fuzz/target.h"
#include "io/scene_formats.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    const auto loaded = io::read_ksplat(file, fuzz::small_scenes());
    if (!fuzz::accepted(loaded.status())) return;
    fuzz::check_scene(loaded.value());
    fuzz::require(loaded.value().gaussians.sh_degree <= 2);
    const auto written = io::write_ply(loaded.value().gaussians);
    fuzz::require(written.ok() && io::read_ply(written.value(), fuzz::small_scenes()).ok());
}

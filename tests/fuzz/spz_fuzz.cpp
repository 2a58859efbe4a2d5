// .spz: what is accepted can be written in both versions and read again.

#include "fuzz/target.h"
#include "io/scene_formats.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    const auto loaded = io::read_spz(file, fuzz::small_scenes());
    if (!fuzz::accepted(loaded.status())) return;
    fuzz::check_scene(loaded.value());
    for (const std::uint32_t version : {3U, 4U}) {
        io::SaveOptions options;
        options.spz_version = version;
        const auto written = io::write_spz(loaded.value().gaussians, options);
        if (written.ok()) fuzz::require(io::read_spz(written.value(), fuzz::small_scenes()).ok());
    }
}

// Detection of the format of a scene, by the first bytes or by the name. What a format accepts can be written in it and
// read again.

#include "io/scene_file.h"

#include "fuzz/target.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    for (const io::SceneFormat& format : io::scene_formats()) {
        const auto found = io::detect_scene_format(file, "x" + std::string(format.extension));
        if (fuzz::accepted(found.status())) fuzz::require(found.value() != nullptr);
        const auto loaded = format.read(file, fuzz::small_scenes());
        if (!fuzz::accepted(loaded.status())) continue;
        fuzz::check_scene(loaded.value());
        if (format.write == nullptr) continue;
        const auto written = io::write_scene(loaded.value().gaussians, format);
        if (written.ok()) fuzz::require(format.read(written.value(), fuzz::small_scenes()).ok());
    }
    const auto unnamed = io::detect_scene_format(file, "x");
    if (fuzz::accepted(unnamed.status())) fuzz::require(unnamed.value() != nullptr);
}

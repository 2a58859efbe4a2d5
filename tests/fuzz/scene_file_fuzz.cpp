// Detection of the format of a scene: by the first bytes, or by the name.

#include "io/scene_file.h"

#include "fuzz/target.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    for (const char* name : {"x.ply", "x.splat", "x.spz", "x"}) {
        const auto format = io::detect_scene_format(file, name);
        if (fuzz::accepted(format.status())) fuzz::require(format.value() != nullptr);
    }
}

// COLMAP: the input is the length of the cameras file (32 bits), that file, and the images file.

#include <algorithm>

#include "fuzz/target.h"
#include "io/colmap.h"
#include "scene/camera_pose.h"

namespace {

using namespace splat;

void check(io::Bytes input) {
    if (input.size() < 4) return;
    const io::Bytes files = input.subspan(4);
    const std::size_t split =
        std::min<std::size_t>(io::number<std::uint32_t>(input.data()), files.size());
    for (const bool binary : {false, true}) {
        const auto read = binary ? io::read_colmap_binary(files.first(split), files.subspan(split))
                                 : io::read_colmap_text(files.first(split), files.subspan(split));
        if (!fuzz::accepted(read.status())) continue;
        for (const auto& camera : read.value().cameras)
            fuzz::require(scene::check_camera(camera).ok());
    }
    static_cast<void>(
        fuzz::accepted(io::read_colmap(files.first(split), files.subspan(split)).status()));
}

}  // namespace

SPLAT_FUZZ_TARGET(check)

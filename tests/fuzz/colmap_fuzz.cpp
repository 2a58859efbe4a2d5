// COLMAP: the input is the file of cameras and that of images.

#include "fuzz/target.h"
#include "io/colmap.h"
#include "scene/camera_pose.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes input) {
    const auto [cameras, images] = fuzz::files_of<2>(input);
    for (const bool binary : {false, true}) {
        const auto read = binary ? io::read_colmap_binary(cameras, images)
                                 : io::read_colmap_text(cameras, images);
        if (!fuzz::accepted(read.status())) continue;
        for (const auto& camera : read.value().cameras)
            fuzz::require(scene::check_camera(camera).ok());
    }
    static_cast<void>(fuzz::accepted(io::read_colmap(cameras, images).status()));
}

// transforms.json: cameras that are accepted are valid and can be written.

#include "fuzz/target.h"
#include "io/transforms_json.h"
#include "scene/camera_pose.h"

namespace {

using namespace splat;

void check(io::Bytes file) {
    io::CameraOptions options;
    options.ignore_distortion = !file.empty() && file.size() % 2 == 0;
    const auto read = io::read_transforms_json(file, 64, 64, options);
    if (!read.ok()) return;
    for (const auto& camera : read.value().cameras) fuzz::require(scene::check_camera(camera).ok());
    fuzz::require(io::write_transforms_json(read.value().cameras).ok());
}

}  // namespace

SPLAT_FUZZ_TARGET(check)

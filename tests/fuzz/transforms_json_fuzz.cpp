// transforms.json: cameras that are accepted are valid and can be written.

#include "fuzz/target.h"
#include "io/transforms_json.h"
#include "scene/camera_pose.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    io::CameraOptions options;
    options.ignore_distortion = !file.empty() && file.size() % 2 == 0;
    const auto read = io::read_transforms_json(file, 64, 64, options);
    if (!fuzz::accepted(read.status())) return;
    for (const auto& camera : read.value().cameras) fuzz::require(scene::check_camera(camera).ok());
    const auto written = io::write_transforms_json(read.value().cameras);
    fuzz::require(written.ok());
    const auto again = io::read_transforms_json(written.value());
    fuzz::require(again.ok() && again.value().cameras.size() == read.value().cameras.size());
}

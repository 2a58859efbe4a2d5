#pragma once

#include "io/bytes.h"
#include "io/camera_set.h"

namespace splat::io {

/// Cameras of a NeRF transforms.json: `frames`, each with `file_path` and `transform_matrix` (OpenGL
/// camera-to-world, 4x4 or 3x4), and `fl_x fl_y cx cy w h camera_angle_x camera_angle_y`, each for
/// all frames or for one. Defaults: fl_x from the angle, fl_y = fl_x, cx and cy in the middle, w and h
/// from `width` and `height`, the size of the images. A frame's mask_path and depth_file_path, and
/// train_filenames, val_filenames and test_filenames, ply_file_path.
///
/// Errors       kFormat with the frame and the key; kUnsupported for distortion (k1 .. k6,
///              p1, p2 other than 0), for OPENCV_FISHEYE and is_fisheye, unless ignored or kept, and for a
///              camera_model that has other parameters, unless ignored. The caller adds the name of the file
/// Source       instant-ngp and nerfstudio, whose documentation describes the keys
Result<CameraSet> read_transforms_json(Bytes file, std::uint32_t width = 0,
                                       std::uint32_t height = 0, const CameraOptions& options = {});

/// The same cameras, intrinsics in every frame. Errors: kInvalidArgument for an invalid camera.
Result<Buffer> write_transforms_json(const std::vector<scene::Camera>& cameras);

}  // namespace splat::io

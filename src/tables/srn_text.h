#pragma once

#include <string_view>
#include <vector>

#include "core/status.h"
#include "scene/vector.h"

namespace splat::tables {

/// The texts of SRN's files, which tables hold unchanged.

struct Focal {
    double x = 0;  ///< in widths of the image
    double y = 0;  ///< in heights
};

/// intrinsics.txt: "f cx cy 0", then a centre, perhaps a near plane, a scale, and last the height and width of the
/// images. Errors: kFormat for another number of numbers, and for numbers that make no camera.
Result<Focal> focal_of(std::string_view intrinsics);

/// pose/*.txt: 16 numbers, row-major camera-to-world, OpenCV axes; whether it is a
/// rigid motion is not checked. Errors: kFormat.
Result<scene::Mat4> pose_of(std::string_view pose);

}  // namespace splat::tables

#pragma once

#include <cstdint>
#include <vector>

#include "io/image.h"
#include "scene/camera.h"
#include "synthetic/object.h"

namespace splat::synthetic {

/// An image and its exact maps, rows from the top.
struct Picture {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::vector<float> rgb;      ///< [height,width,3], 0 to 1, over white
    std::vector<float> depth;    ///< [height,width] along z; 0 where nothing is hit
    std::vector<float> normals;  ///< [height,width,3] in the camera's axes; 0 where nothing is hit
};

/// Cast rays at fitted() solids.
///
/// depth, normals   of the ray through the pixel's centre, exact up to rounding to float32
/// rgb              color (0.45 + 0.55 max(0, n . l)), l fixed in the world; a pixel is the mean of 4 x 4
///                  rays if the 3 x 3 pixels around it show different faces, else one ray
/// Determinism      the same bits on every run
Picture cast(const Solids& solids, const scene::Camera& camera);

/// 255 where a solid is hit, else 0.
io::Image mask_image(const Picture& picture);

}  // namespace splat::synthetic

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/status.h"
#include "scene/camera.h"
#include "scene/vector.h"

namespace splat::prior_scores {

/// The plane normal . x = -distance of a camera's axes (x right, y down, z forward).
struct FoundPlane {
    scene::Vec3 normal{};  ///< unit normal, facing the camera
    double distance = 0;   ///< from the camera's centre, > 0
    std::uint64_t pixels = 0;
};

struct PlaneRules {
    double degrees = 15;  ///< most angle between a pixel's normal and its plane's
    double offset =
        0.02;  ///< most distance of a pixel's point from its plane, as a share of its depth
    double least = 0.005;  ///< pixels of the smallest plane, as a share of the map's
};

inline constexpr double kLeastPlaneShare =
    1e-3;  ///< smallest PlaneRules::least, which bounds the time
inline constexpr std::size_t kMostPlanes = 255;  ///< planes of a map; the largest are kept

struct PlaneMap {
    std::vector<std::uint32_t> ids;  ///< [height, width]: 0 none, else 1 + the place in `planes`
    std::vector<FoundPlane> planes;  ///< by descending pixels, then by their first pixel
};

/// The planes that a depth map shows, by growing regions:
///
///   1. From the flattest pixel that has no region, neighbours (4) join while their normal and their point agree
///      with the region's plane. That is the mean normal through the mean point of the first 16 pixels, then the
///      plane with the least squares of distances, found anew at each doubling of the pixels.
///   2. Regions of one plane become one, also where something stands before it: the mean point of each lies on the
///      plane of the other, and the normals agree.
///   3. What is smaller than rules.least is left out. Pixels beside a plane whose points lie on it join it.
///
/// depth      [height, width] distances along the axis; 0 or less: no surface
/// normals    [height, width, 3] in the camera's axes, of any length; shorter than 0.5: none
/// camera     focal lengths and principal point; its pose is not read
/// Errors     kShape if a size does not fit; kInvalidArgument for numbers that are not finite and rules outside of
///            0 < degrees <= 90, 0 < offset <= 1, kLeastPlaneShare <= least <= 1
/// Precision  float64
/// Determinism  bit-exact: ties go to the first pixel
/// Source     Poppinga et al. 2008, doi:10.1109/IROS.2008.4650729, from the flattest pixel as Rabbani et al. 2006,
///            "Segmentation of point clouds using smoothness constraint"
Result<PlaneMap> find_planes(std::span<const float> depth, std::span<const float> normals,
                             const scene::Camera& camera, const PlaneRules& rules = {});

}  // namespace splat::prior_scores

#pragma once

#include "data/dataset.h"

namespace splat::data {

/// Distances along the axes of cameras in which a scene lies; of CO3D, beyond those of its origin.
struct DepthRange {
    bool known = false;
    /// By points of the scene, all but the nearest and the farthest hundredth of those in the views. Else by the
    /// cameras: around the place that they look at, what their images show there.
    bool by_points = false;
    double near = 0, far = 0;
    /// By the cameras: half of that, which a scene that fills its images has for sure; of CO3D the place alone.
    double least_near = 0, least_far = 0;
    std::vector<float> depths;  ///< sorted depths of the points in the views

    void add(const DepthRange& other);
};

/// The depth range of one object. Not known where the cameras look at no common place. Errors: as reader.cameras().
Result<DepthRange> depth_range(const DatasetReader& reader, std::uint32_t object);

/// What data.znear and data.zfar hold a known range with a margin.
struct HoldingRange {
    double znear = 0, zfar = 0;
};
HoldingRange holding_range(const DepthRange& range);

/// A sentence if data.znear and data.zfar do not hold the scenes of up to 8 objects, evenly spread; else empty.
/// Errors: as depth_range().
Result<std::string> depth_range_warning(const DatasetReader& reader, double znear, double zfar);

}  // namespace splat::data

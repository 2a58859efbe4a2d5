#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "vkrun/cli/handles.h"

namespace vkrun::bench {

/// A scene and its cameras.
struct RasterCase {
    std::string title;
    Scene scene;
    std::vector<splat_camera> cameras;  ///< cameras of one size; each call draws one
    splat_convention convention = SPLAT_CONVENTION_3DGS;
    float background[3] = {0, 0, 0};
};

struct RasterCaseOptions {
    std::string scene;    ///< file; empty: random Gaussians
    std::string cameras;  ///< file; empty: an orbit
    std::uint32_t orbit = 0;
    std::optional<double> distance;  ///< scene units
    std::optional<double> scale;     ///< multiplies the size of the images
    std::string size;
    bool ignore_distortion = false;
    std::string convention = "3dgs";
    std::vector<float> background = {0, 0, 0};
};

/// Throws a usage Failure for an option that would have no effect.
void check_options(const RasterCaseOptions& options);

RasterCase make_case(const RasterCaseOptions& options);

}  // namespace vkrun::bench

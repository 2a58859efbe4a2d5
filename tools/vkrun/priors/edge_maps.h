#pragma once

#include <splat.h>

#include <string>
#include <vector>

#include "vkrun/priors/depth_source.h"

namespace vkrun {

/// Edges in place of a network's maps.
struct EdgeOptions {
    bool use = false;
    std::vector<std::string> operators;  ///< names of edge_operators(), one for each channel
};

/// "canny", "sobel", "scharr", "prewitt".
const std::vector<std::string>& edge_operators();

/// The operators of a map by default: all for "edges", else one for each channel of the map that a network takes.
std::vector<std::string> default_operators(const std::string& map);

/// [height,width] from 0 to 1: gray as OpenCV's BGR2GRAY makes it of 8 bits.
LoadedDepth gray_plane_of(const splat_image& picture);

/// The edges of a plane from 0 to 1, [height,width,operators]. Throws a Failure of bad data.
std::vector<float> edges_of(const splat_image& plane, const std::vector<std::string>& operators);

}  // namespace vkrun

#pragma once

#include <string>

namespace vkrun {

/// Folders of maps of the photographs.
struct GeometryMaps {
    std::string depth;    ///< NAME.npy: distances along the camera's axis, 0 where there is none
    std::string normals;  ///< NAME.npy
};

/// Make maps of all photographs of a folder in OUT-geometry by one pass each of a network, as MoGe-2: a preset, or the
/// file of a model. Maps that are there already are kept, if they are of the same photographs and model. Throws a
/// Failure.
GeometryMaps make_geometry_maps(const std::string& network, const std::string& photos,
                                const std::string& out, const std::string& device, bool overwrite);

}  // namespace vkrun

#pragma once

#include <splat.h>

#include <string>
#include <vector>

#include "vkrun/predict/network_mask.h"
#include "vkrun/priors/map_maker.h"

namespace vkrun {

/// What one pass of a network of geometry, as MoGe-2, tells of a picture, as far as nothing else tells it.
struct PictureGeometry {
    std::vector<std::uint8_t> depth_bytes, normal_bytes;
    splat_image depth{},
        normal{};      ///< views of them, as maps of 'vkrun priors'; no pixels: not wanted
    double focal = 0;  ///< pixels; 0: not wanted
    NetworkMask mask;
    std::string preset;             ///< empty: no network ran
    std::vector<std::string> used;  ///< "depth", "normals", "mask", "focal length"
    std::vector<std::string> warnings;
};

/// What of it is wanted.
struct WantedGeometry {
    bool depth = false, normal = false, focal = false, mask = false;
    [[nodiscard]] bool any() const { return depth || normal || focal || mask; }
};

/// Run a network on a picture. A mask of nothing or of everything is left out, with a warning. Throws a Failure.
PictureGeometry run_geometry(const ModelSource& source, const LoadedPicture& picture,
                             const WantedGeometry& wanted);

/// Run the network that options.geometry names (a preset, or the file of a model), else one whose file is where 'vkrun
/// priors where' says, on the picture, if the predictor needs maps or a focal length that the options lack and the
/// picture's Exif data does not tell, or if `no_mask`: nothing marks the object. The network's mask shows where the
/// picture has geometry, so it is left out where that is nearly all of it. Throws a Failure, except for a network that
/// nobody named, of which a warning tells.
PictureGeometry picture_geometry(const PredictionOptions& options, const splat_predictor_info& info,
                                 splat_device device, bool no_mask);

}  // namespace vkrun

#pragma once

#include <splat.h>

#include <optional>
#include <string>
#include <vector>

#include "vkrun/priors/map_jobs.h"

namespace vkrun {

/// What normals of depth maps need besides these.
struct DepthOptions {
    bool use = false;
    std::optional<double> fov_degrees;  ///< across the width; default: by intrinsics.txt
    std::vector<double>
        distances;  ///< nearest and farthest of relative depth; empty: .npy of distances
    std::string inverse_preset;  ///< made the .npy, which are no distances then; may be empty
};

/// A depth map, or one of normals, in memory.
struct LoadedDepth {
    std::vector<float> values;
    splat_image image{};  ///< view of `values`
    splat_normals_desc desc{};
};

/// The preset of inverse depth that, as priors-depth.json says, made the .npy maps of a folder; empty if none did.
std::string inverse_preset_of(const std::string& folder);

/// The depth map of a picture, where maps go or beside its folder rgb/; a .npy from its least, 0, to
/// its greatest number, 1. Throws a Failure of bad data.
LoadedDepth load_depth_plane(const MapJob& job);

/// The same depth map with its own numbers, and its camera. Throws a Failure: of usage for numbers that are no
/// distances, else of bad data.
LoadedDepth load_depth(const MapJob& job, const DepthOptions& options);

/// The normal map of a picture, found like its depth map: x, y, z, or (n + 1) / 2. Throws a Failure of bad data.
LoadedDepth load_normals(const MapJob& job, bool vectors);

}  // namespace vkrun

#pragma once

#include <vector>

#include "prior_models/network.h"
#include "prior_models/prepare.h"

namespace splat::prior_models {

/// The form in which a map is wanted.
enum class MapForm {
    kBytes,   ///< 0 to 255, as the reference writes them
    kUnit,    ///< the same numbers before they are reduced to bytes, 0 to 1
    kModels,  ///< the model's: depth at its scale, normals from -1 to 1, masks from 0 to 1
};

/// A map of a picture.
struct PriorMap {
    Extent size;
    std::uint32_t channels = 1;
    std::vector<float> values;  ///< [height,width,channels]
    double focal = 0;           ///< focal length of the camera that points tell, pixels; else 0
    bool guessed = false;       ///< no camera sees the points: `focal` is that of kOtherwiseDegrees
};

/// What a map is made of.
struct MapSource {
    const NetworkTensor* main = nullptr;
    const NetworkTensor* scale = nullptr;  ///< scale of points, or null
    const NetworkTensor* mask = nullptr;   ///< mask of points, or null
    std::size_t picture = 0;               ///< in the batch
};

/// An output as a map of the size of its picture.
///
///   depth    resampled, then (v - least) / (greatest - least + 1e-8); bytes are 255 v, truncated. Distances and
///            points become 1 / distance first
///   normals  resampled, n / max(|n|, 1e-12), signs; unit (n + 1) / 2, bytes 127.5 (n + 1), truncated
///   masks    sigmoid, min-max; then resampled and reduced to bytes (255 v, truncated), or the other way
///            round
///
/// Errors  kFormat for a rank or a number of channels that does not fit; kInvalidState for numbers that
///         are not finite; `name` stands for the output in both
/// Source  the reference's scripts for its priors; rembg's sessions
Result<PriorMap> finish(const PresetOutput& output, const MapSource& source, Extent size,
                        MapForm form, const std::string& name);

}  // namespace splat::prior_models

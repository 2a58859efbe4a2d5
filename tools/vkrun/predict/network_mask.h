#pragma once

#include <splat.h>

#include <cstdint>
#include <string>
#include <vector>

#include "vkrun/predict/prediction.h"

namespace vkrun {

/// The mask that a network makes of a picture.
struct NetworkMask {
    std::vector<std::uint8_t> bytes;
    splat_image image{};  ///< view of `bytes`; no pixels: none was made
    std::string preset;   ///< name of the network's preset
    std::string warning;  ///< why a network at hand gave none; may be empty
};

/// Make a mask by the network that the options or SPLAT_MASK_MODEL name, else by one of a preset whose file is
/// where 'vkrun priors where' says. None without a network, where the picture's alpha marks the object or the mask
/// marks none, and if the options say how the object is found. Throws a Failure, except for a network that nobody
/// named.
NetworkMask network_mask(const PredictionOptions& options);

}  // namespace vkrun

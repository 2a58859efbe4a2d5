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

/// What marks the object of a picture: its alpha, its border, or nothing.
splat_found found_without_network(const splat_image& picture);

/// Leave out a mask of nothing or of everything, by the bounds that the library has for the border's, with a warning.
void drop_without_object(NetworkMask& mask);

/// The first preset that makes nothing but masks and whose model is there; "" for none. Masks of models that also make
/// depth show where a depth is valid, not the object.
std::string mask_preset_at_hand();

/// Make a mask by the network that the options or SPLAT_MASK_MODEL name, else by one of a preset whose file is
/// where 'vkrun priors where' says. None without a network, where the picture's alpha marks the object or the mask
/// marks none, and if the options say how the object is found. Throws a Failure, except for a network that nobody
/// named.
NetworkMask network_mask(const PredictionOptions& options);

}  // namespace vkrun

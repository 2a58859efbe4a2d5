#pragma once

#include <splat.h>

#include <string>

namespace vkrun {

/// Make masks of the objects of photographs in OUT/masks by a network: that of SPLAT_MASK_MODEL, else the first preset
/// that is at hand. Masks that are there stay, unless `overwrite` is set. Returns their folder. Throws a Failure with
/// what to do.
std::string make_object_masks(const std::string& photos, const std::string& out, bool overwrite);

/// Keep the Gaussians of the object of a fit: those whose mean at least half of the views that see it have inside their
/// mask, and of these the largest cluster. `out` is the folder of the run, whose config.json names cameras and masks.
/// Says on standard error how many stay. Throws a Failure.
void keep_object(splat_scene scene, const std::string& out);

}  // namespace vkrun

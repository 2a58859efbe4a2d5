#pragma once

#include "core/json_tree.h"
#include "prior_models/preset.h"

namespace splat::prior_models {

/// A preset from parsed JSON. Errors: as parse_preset().
Result<Preset> read_preset(const JsonTree& tree);

}  // namespace splat::prior_models

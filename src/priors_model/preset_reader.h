#pragma once

#include "core/json_tree.h"
#include "priors_model/preset.h"

namespace splat::priors_model {

/// A preset from parsed JSON. Errors: as parse_preset().
Result<Preset> read_preset(const JsonTree& tree);

}  // namespace splat::priors_model

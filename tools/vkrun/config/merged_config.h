#pragma once

#include <string>
#include <vector>

#include "vkrun/cli/json.h"

namespace vkrun {

/// The configuration of a file (none: the defaults) with changes "key=value". Throws a Failure.
Json merged_config(const std::string& path, const std::vector<std::string>& changes);

/// The configuration that belongs to a file of weights: `given`, or config.json or config.yaml in the folder
/// of the file. Throws a Failure.
std::string config_beside(const std::string& weights, const std::string& given);

}  // namespace vkrun

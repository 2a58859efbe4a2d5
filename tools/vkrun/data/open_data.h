#pragma once

#include <string>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"

namespace vkrun {

/// A split of the data set of a merged configuration; `root`, unless empty, replaces data.root. Throws a
/// Failure.
Dataset open_data(const Json& config, const std::string& root, const std::string& split);

}  // namespace vkrun

#pragma once

#include <string>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"

namespace vkrun {

/// Import the tables of a split under a progress bar, if the folder holds tables; else do nothing. `format` is
/// data.format. Throws a Failure.
void import_first(const std::string& folder, const std::string& format, const std::string& split);

/// A split of the data set of a merged configuration; `root`, unless empty, replaces data.root. Throws a
/// Failure.
Dataset open_data(const Json& config, const std::string& root, const std::string& split);

}  // namespace vkrun

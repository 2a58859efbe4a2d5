#pragma once

#include <string>
#include <vector>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/shard.h"
#include "vkrun/eval/eval_report.h"

namespace vkrun {

/// Save into OUT/shard_I_of_N what a shard scored, with `settings`, an object that the shards must agree in, and take
/// over what the others did. False: some are not there yet. Throws a Failure.
bool merge_shards(const std::string& out, const Shard& shard, const Json& settings,
                  splat_evaluator evaluator);

/// The objects that an evaluator saved in a folder, all of those that it scores. Throws a Failure.
std::vector<ObjectRow> saved_rows(const std::string& folder);

}  // namespace vkrun

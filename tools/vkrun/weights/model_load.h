#pragma once

#include <splat.h>

#include <string>

#include "vkrun/cli/json.h"

namespace vkrun {

/// The flags of splat_model_load that graft weights whose channels after RGB are `channels`: depth,
/// normal, mask, plane. Throws a usage Failure that names `option` for another word.
std::uint32_t graft_flags(const char* option, const std::vector<std::string>& channels);

/// "215 tensors copied, 1 widened, 0 new, 0 left out": `load` of a model's report.
std::string load_counts(const Json& load);

/// A sentence if the ray grid of the file `path` differs from that of the model's configuration:
/// which of the two is used, and the fields of view. Empty if they agree.
std::string rays_sentence(const std::string& path, splat_weights weights, const Json& report);

/// Print rays_sentence() as a warning on standard error.
void warn_of_rays(const std::string& path, splat_weights weights, const Json& report);

}  // namespace vkrun

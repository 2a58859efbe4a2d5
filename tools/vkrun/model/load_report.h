#pragma once

#include <splat.h>

#include <string>

#include "vkrun/device_text.h"

namespace vkrun {

/// What splat_model_report says of a model. Throws a Failure.
Json model_report(splat_model model);

/// "215 tensors copied, 1 widened, 0 new, 0 left out": `load` of a model's report.
std::string load_counts(const Json& load);

/// A sentence where the ray grid of the file, whose name is `path`, is another than that of the model's
/// configuration: which of the two counts, with both fields of view where they have one. Else empty.
std::string rays_sentence(const std::string& path, splat_weights weights, const Json& report);

/// That sentence as a warning on standard error.
void warn_of_rays(const std::string& path, splat_weights weights, const Json& report);

}  // namespace vkrun

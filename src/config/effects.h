#pragma once

#include <string>
#include <vector>

#include "core/config.h"

namespace splat::config {

/// What a training of this configuration would not do as its file may intend, one sentence for each: keys
/// that have no effect here, and adapters that cannot use new input channels. Values that ask for nothing
/// (null, false, 0, "", one device) are not named.
///
/// Errors  kInvalidArgument, naming file and key, where the training would be another one: opt.pretrained_hf,
///         keys of adapters without opt.lora_finetune, vectors of views without their file; as
///         predictor_config() and train_config()
Result<std::vector<std::string>> training_warnings(const Config& config);

/// The names of the keys with different values, in the order of the table. Both configurations have every
/// value, as merged_config_text() writes them.
std::vector<std::string> changed_keys(const Config& run, const Config& given);

/// Whether a run may be resumed with another value of this key.
bool may_change_on_resume(std::string_view key);

}  // namespace splat::config

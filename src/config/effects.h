#pragma once

#include <string>
#include <vector>

#include "core/config.h"

namespace splat::config {

/// Where a training takes the vectors of its views from, where its network takes some.
enum class VectorsFrom { kFiles, kCaller };

/// What a training of this configuration would not do as its file may intend, one sentence for each: keys
/// that have no effect here, and adapters that cannot use new input channels. Values that ask for nothing
/// (null, false, 0, "", one device) are not named.
///
/// Errors  kInvalidArgument, naming file and key, where the training would be another one: opt.pretrained_hf,
///         keys of adapters without opt.lora_finetune, vectors of views without their file; as
///         model_config() and train_config()
Result<std::vector<std::string>> training_warnings(const Config& config,
                                                   VectorsFrom vectors = VectorsFrom::kFiles);

/// The text of a key's value in a configuration of merged_config_text(), which leaves out the keys of
/// adapters and opt.freeze where they have their defaults.
std::string value_text(const Config& config, const std::string& key);

/// The names of the keys with different value_text(), in the order of the table.
std::vector<std::string> changed_keys(const Config& run, const Config& given);

/// True if a run may be resumed with another value of this key.
bool may_change_on_resume(std::string_view key);

}  // namespace splat::config

#pragma once

#include <span>

#include "config/config_keys.h"
#include "config/heads.h"

namespace splat::config {

/// Errors: kInvalidArgument, with the nearest name, for an unknown section or key. Sections that published files
/// have for other programs (hydra, wandb) are ignored.
Status check_names(const Config& config);

/// The network of a configuration as the published ones are written (Hydra's merged config.yaml). Keys that
/// are not given have the values of data.category (category.h). The categories hydrants and teddybears mean
/// CO3D's geometry, as in the published code: fov 0, and origin distances. Without an embedding, its other
/// keys may have any value that published files have. `heads` are those that model.head names.
///
/// Errors  kInvalidArgument, naming file and key, for a value of another kind or beyond its range, or one
///         that contradicts the category; as check_names() and check()
Result<ModelConfig> model_config(const Config& config, std::span<const Head> heads = kHeads);

/// The training that a configuration describes, with the values of its category.
///
/// Errors  kInvalidArgument, naming file and key; as check_names()
Result<TrainConfig> train_config(const Config& config);

/// Both configurations. Errors: as model_config() and train_config().
Result<Settings> settings_of(const Config& config);

/// Replace values of a configuration: each text is "key=value", the value as YAML has it ("1e-4",
/// "[1, 2]", "true"). With another data.category, values that are those of the old one become those of the
/// new one. Errors: kInvalidArgument, with the text.
Result<Config> with_values(const Config& config, std::span<const std::string> texts);

/// The network as JSON that model_config() reads back.
std::string config_text(const ModelConfig& network);

/// Network and training as one JSON text, every value included, that train_config() and model_config()
/// read back.
std::string merged_config_text(const Settings& settings);

}  // namespace splat::config

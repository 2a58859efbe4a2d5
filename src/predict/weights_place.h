#pragma once

#include <optional>
#include <string>

#include "config/config_keys.h"
#include "io/weights_file.h"

namespace splat::predict {

inline constexpr const char* kDefaultWeights = "cars64";

/// The path of built-in weights: of share/libsplat/weights where the library is installed, of
/// tools/weights where it lies in a build folder. Errors: kNotFound, with the names that there are.
Result<std::string> builtin_weights(const std::string& name);

/// The same, for a library in the folder `library`.
Result<std::string> builtin_weights_near(const std::string& library, const std::string& name);

/// The file that is meant: a path, or built-in weights by their name where no file is called so. Errors: as
/// builtin_weights, for a name.
Result<std::string> weights_named(const std::string& given);

/// The configuration beside a file of weights: its name with .json or .yaml, else config.json or config.yaml in
/// its folder; before these NAME.json of a file of adapters, which may be for another category. Errors: kNotFound.
Result<std::string> config_beside(const std::string& weights, const std::string& adapters = "");

/// Network and training of a configuration. Errors: those of config::model_config and
/// config::train_config.
Result<config::Settings> settings_of(const std::string& text, const std::string& what);

/// The factor lora_alpha of a file of adapters: that of its metadata, else of the configuration's adapters.
/// Errors: kInvalidArgument if neither says it.
Result<double> adapters_alpha(const io::WeightsFile& adapters, const config::ModelConfig& network);

/// Degrees, from the first row of a file's ray grid [1,3,R,R], which holds x / f at the middles of its
/// pixels. Empty if the file has no such grid.
std::optional<double> field_of_view(const io::NamedTensors& tensors);

}  // namespace splat::predict

#pragma once

#include <string>
#include <vector>

#include "vkrun/cli/json.h"

namespace vkrun {

/// The text of a file, or of the library's configuration of this name, such as "cars". Throws a usage Failure.
std::string config_text(const std::string& path);

/// The configuration of a file or name (none: the defaults) with changes "key=value". Throws a Failure.
Json merged_config(const std::string& path, const std::vector<std::string>& changes);

/// The configuration beside a file of weights: its name with .json or .yaml, else config.json or config.yaml in
/// its folder; empty if there is none.
std::string find_config(const std::string& weights);

/// The configuration that belongs to a file of weights: `given`; or NAME.json of a file of adapters, which may be for
/// another category; or that beside the weights; empty if there is none.
std::string config_beside(const std::string& weights, const std::string& given,
                          const std::string& adapters = "");

/// A file of adapters: `given`, or where that is a name and no file, NAME.safetensors beside the weights.
std::string adapters_beside(const std::string& weights, const std::string& given);

/// Where commands that write weights write their configuration: the name of the weights with .json.
std::string config_target(const std::string& weights);

/// Throws a usage Failure if that file exists with another configuration and is the one that is read, or may not be
/// replaced.
void check_config_target(const std::string& weights, const Json& config, bool overwrite,
                         const std::string& read = "");

/// Write that file. Throws a Failure.
void write_config_beside(const std::string& weights, const Json& config);

}  // namespace vkrun

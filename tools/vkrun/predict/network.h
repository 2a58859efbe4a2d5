#pragma once

#include <string>
#include <vector>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"

namespace CLI {
class App;
}

namespace vkrun {

/// --config and --adapters.
void add_network_options(CLI::App& command, std::string& config, std::string& adapters);

/// What a network is made of.
struct NetworkFiles {
    std::string weights, adapters;  ///< paths; the adapters' may be empty
    Json config;
};

/// The files and the configuration that --config, --adapters and --set mean for a file of weights. Throws a usage
/// Failure.
NetworkFiles network_files(const std::string& weights, const std::string& config,
                           const std::string& adapters,
                           const std::vector<std::string>& changes = {});

/// True for a configuration of LGM's network.
bool is_lgm(const Json& config);

/// A network on a device.
struct Network {
    NetworkFiles files;
    ScenePredictor predictor;
    splat_predictor_info info = sized<splat_predictor_info>();
};

/// How predictions are joined, see splat_predictor_desc.
struct Joining {
    std::uint32_t aggregate = 0;
    splat_convention convention = 0;
};

/// The convention "3dgs" or "ray_maximum".
splat_convention convention_of(const std::string& name);

/// Load a network and print its warnings. `weights`, unless NULL, are those of the file. Throws a Failure.
Network load_network(splat_device device, const NetworkFiles& files,
                     splat_weights weights = nullptr, const Joining& joining = {});

}  // namespace vkrun

#include "vkrun/predict/network.h"

#include <CLI/CLI.hpp>
#include <cstdio>

#include "vkrun/config/merged_config.h"

namespace vkrun {

void add_network_options(CLI::App& command, std::string& config, std::string& adapters) {
    command
        .add_option("--config", config,
                    "Configuration of the network; default: that of the adapters, NAME.json\n"
                    "beside them; else that beside the weights, the first that is there of\n"
                    "NAME.json, NAME.yaml, config.json and config.yaml")
        ->type_name("FILE");
    command
        .add_option("--adapters", adapters,
                    "Low-rank adapters to fold into the weights: a file, with its configuration\n"
                    "beside it as NAME.json; or NAME alone for NAME.safetensors in the folder of\n"
                    "the weights, as chairs for the built-in ones")
        ->type_name("FILE");
}

NetworkFiles network_files(const std::string& weights, const std::string& config,
                           const std::string& adapters, const std::vector<std::string>& changes) {
    const std::string beside = adapters_beside(weights, adapters);
    return {weights, beside, merged_config(config_beside(weights, config, beside), changes)};
}

Network load_network(splat_device device, const NetworkFiles& files, splat_weights weights) {
    Network network;
    network.files = files;
    const Weights own = weights == nullptr ? load_weights(files.weights) : Weights();
    const std::string config = files.config.dump();
    auto desc = sized<splat_predictor_desc>();
    desc.weights_path = files.weights.c_str();
    desc.weights = weights == nullptr ? own.get() : weights;
    desc.config = config.c_str();
    if (!files.adapters.empty()) desc.adapters_path = files.adapters.c_str();
    const splat_result made = splat_predictor_create(device, &desc, network.predictor.out());
    check(made, made == SPLAT_ERROR_INVALID_ARGUMENT ? kUsageError : kBadData);
    check(splat_predictor_get_info(network.predictor.get(), &network.info));
    const Json report = library_json(splat_predictor_report, network.predictor.get());
    for (const Json& warning : report.at("warnings"))
        std::fprintf(stderr, "vkrun: warning: %s\n", warning.get<std::string>().c_str());
    return network;
}

}  // namespace vkrun

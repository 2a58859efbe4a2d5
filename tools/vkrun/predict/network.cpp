#include "vkrun/predict/network.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "core/os/path.h"
#include "vkrun/cli/log.h"
#include "vkrun/cli/text.h"
#include "vkrun/config/merged_config.h"
#include "vkrun/weights/published.h"
#include "vkrun/weights/published_config.h"

namespace vkrun {

void add_network_options(CLI::App& command, std::string& config, std::string& adapters) {
    command
        .add_option(
            "--config,--model", config,
            "Configuration of the network, a file or the name of a published one; default: that of "
            "the adapters, NAME.json\n"
            "beside them; else that beside the weights, the first that is there of\n"
            "NAME.json, NAME.yaml, config.json and config.yaml; else the published one that\n"
            "the weights fit, by tensors, file name or hash ('vkrun config presets')")
        ->type_name("FILE");
    command
        .add_option("--adapters", adapters,
                    "Low-rank adapters to fold into the weights: a file, with its configuration\n"
                    "beside it as NAME.json; or NAME alone for NAME.safetensors in the folder of\n"
                    "the weights, as chairs for the built-in ones")
        ->type_name("FILE");
}

namespace {

/// The name of the published configuration that weights without one fit. Throws a usage Failure.
std::string config_that_fits(const std::string& weights) {
    const PublishedConfig found = published_config(weights, load_weights(weights).get());
    const std::string none = "no configuration lies beside '" + weights + "'";
    if (found.name.empty())
        throw Failure(kUsageError, none +
                                       ", neither of its name with .json or .yaml, nor "
                                       "config.json or config.yaml, and " +
                                       found.sentence + ": name one with --config");
    std::fprintf(stderr, "vkrun: note: %s; the published one of %s, which it fits, is taken\n",
                 none.c_str(), found.name.c_str());
    return found.name;
}

}  // namespace

NetworkFiles network_files(const std::string& weights, const std::string& config,
                           const std::string& adapters, const std::vector<std::string>& changes) {
    const std::string beside = adapters_beside(weights, adapters);
    std::string found = config_beside(weights, config, beside);
    if (found.empty()) found = config_that_fits(weights);
    return {weights, beside, merged_config(found, changes)};
}

bool is_lgm(const Json& config) {
    return config.value("/model/network"_json_pointer, "") == "lgm_unet";
}

splat_convention convention_of(const std::string& name) {
    return name == "3dgs" ? SPLAT_CONVENTION_3DGS : SPLAT_CONVENTION_RAY_MAXIMUM;
}

namespace {

/// Large files take a while.
void note_reading(const std::string& weights) {
    std::error_code failed;
    const std::uintmax_t bytes = std::filesystem::file_size(splat::os::path_of(weights), failed);
    if (!failed)
        std::fprintf(stderr,
                     "vkrun: note: reading '%s' takes %s of host memory, twice that if its numbers "
                     "have 16 bits\n",
                     weights.c_str(), bytes_text(bytes).c_str());
}

}  // namespace

Network load_network(splat_device device, const NetworkFiles& files, splat_weights weights,
                     const Joining& joining) {
    Network network;
    network.files = files;
    warn_of_old_weights(files.weights);
    if (weights == nullptr && is_lgm(files.config)) note_reading(files.weights);
    const Weights own = weights == nullptr ? load_weights(files.weights) : Weights();
    const std::string config = files.config.dump();
    auto desc = sized<splat_predictor_desc>();
    desc.weights_path = files.weights.c_str();
    desc.weights = weights == nullptr ? own.get() : weights;
    desc.config = config.c_str();
    desc.aggregate = joining.aggregate;
    desc.convention = joining.convention;
    if (!files.adapters.empty()) desc.adapters_path = files.adapters.c_str();
    std::optional<ShowInfo> memory;  // which large networks take
    if (is_lgm(files.config)) memory.emplace();
    const splat_result made = splat_predictor_create(device, &desc, network.predictor.out());
    memory.reset();
    check(made, made == SPLAT_ERROR_INVALID_ARGUMENT ? kUsageError : kBadData);
    check(splat_predictor_get_info(network.predictor.get(), &network.info));
    const Json report = library_json(splat_predictor_report, network.predictor.get());
    for (const Json& warning : report.at("warnings"))
        std::fprintf(stderr, "vkrun: warning: %s\n", warning.get<std::string>().c_str());
    return network;
}

}  // namespace vkrun

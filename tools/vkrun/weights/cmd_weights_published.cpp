// vkrun weights where, get: the weights that the authors of Splatter Image have published.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "vkrun/cli/command.h"
#include "vkrun/cli/download.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/table.h"
#include "vkrun/weights/published.h"

namespace vkrun {
namespace {

constexpr const char* kWeightsWhereFooter =
    R"(Without NAME, lists the weights that the authors of Splatter Image have published. With it, prints address, file,
size, hash, licence and configuration, and commands that fetch it, go on after an interruption, and check it, as
'vkrun weights get NAME' does.

Exit status: 0 done, 2 wrong usage, or there are no such weights.

Examples:
  vkrun weights where
  vkrun weights where cars --json
)";

constexpr const char* kWeightsGetExamples =
    R"(
'vkrun predict' and 'vkrun eval' find the configuration by the tensors and the name of the file.

Exit status: 0 done, or there already; 1 not fetched; 2 wrong usage, there are no such weights, or no hash is known;
4 the file is another one.

Examples:
  vkrun weights get cars
  vkrun weights get chairs --unverified --out models/
)";

/// From the authors' repository or SPLAT_MIRROR.
Download download_of(const PublishedWeights& weights, const std::string& out = "") {
    return {mirrored(published_address(weights), weights.file), download_path(out, weights.file), 0,
            weights.sha256};
}

std::string hash_or_unknown(const std::string& text) {
    return text.empty() ? "not known" : text;
}

Json published_json(const PublishedWeights& weights) {
    const Download download = download_of(weights);
    return {{"name", weights.name},
            {"about", weights.about},
            {"address", download.url},
            {"file", weights.file},
            {"size", weights.size},
            {"sha256", download.sha256.empty() ? Json() : Json(download.sha256)},
            {"licence", kPublishedLicence},
            {"config", weights.name}};
}

void print_published() {
    Table table({"name", "file", ">size", "config", "sha256", "what"});
    std::string address;
    for (const PublishedWeights& one : published_weights()) {
        address = download_of(one).url;
        table.add({one.name, one.file, one.size, one.name, hash_or_unknown(one.sha256), one.about});
    }
    std::printf("%s\naddress  %s/FILE\nlicence  %s\n", table.text().c_str(),
                address.substr(0, address.rfind('/')).c_str(), kPublishedLicence);
}

void print_published_one(const PublishedWeights& weights) {
    const Download download = download_of(weights);
    std::printf(
        "weights  %s: %s\naddress  %s\nfile     %s\nsize     %s\nsha256   %s\nlicence  %s\nconfig  "
        " "
        "%s ('vkrun config show %s')\n\nFetch it, or go on fetching it: 'vkrun weights get %s%s', "
        "or\n%s\n",
        weights.name, weights.about, download.url.c_str(), weights.file, weights.size,
        hash_or_unknown(download.sha256).c_str(), kPublishedLicence, weights.name, weights.name,
        weights.name, download.sha256.empty() ? " --unverified" : "",
        fetch_commands(download).c_str());
}

int where_weights(const std::string& name, bool json) {
    if (name.empty() && json) {
        Json all = Json::array();
        for (const PublishedWeights& one : published_weights()) all.push_back(published_json(one));
        print_json(all);
    } else if (name.empty()) {
        print_published();
    } else if (json) {
        print_json(published_json(published_weights(name)));
    } else {
        print_published_one(published_weights(name));
    }
    return kSuccess;
}

struct WeightsGetOptions {
    std::string name, out;
    bool unverified = false, json = false;
};

int get_weights(const WeightsGetOptions& options) {
    const PublishedWeights& weights = published_weights(options.name);
    const Json fetched = fetch(download_of(weights, options.out), options.unverified);
    if (options.json)
        print_json(fetched);
    else
        std::printf("%s\nlicence: %s\n", fetched_text(fetched).c_str(), kPublishedLicence);
    return kSuccess;
}

}  // namespace

void add_weights_published(CLI::App& weights, int& exit_code) {
    CLI::App* where_command = add_command(
        weights, "where", "List published weights, and where they are had.", kWeightsWhereFooter);
    const auto name = std::make_shared<std::string>();
    const auto json = std::make_shared<bool>(false);
    where_command->add_option("NAME", *name, "Name of published weights")->type_name("");
    add_json_flag(*where_command, *json);
    where_command->callback([name, json, &exit_code] { exit_code = where_weights(*name, *json); });

    CLI::App* get_command = add_command(weights, "get", "Fetch published weights.",
                                        std::string(kDownloadHelp) + kWeightsGetExamples);
    const auto options = std::make_shared<WeightsGetOptions>();
    get_command->add_option("NAME", options->name, "Name of published weights")
        ->required()
        ->type_name("");
    add_download_options(*get_command, options->out, options->unverified,
                         "the published name,\nin the current folder");
    add_json_flag(*get_command, options->json);
    get_command->callback([options, &exit_code] { exit_code = get_weights(*options); });
}

}  // namespace vkrun

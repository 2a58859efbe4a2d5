// vkrun priors get: fetch the model of a preset.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "vkrun/cli/command.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/path_name.h"
#include "vkrun/priors/preset_list.h"

namespace vkrun {
namespace {

#if defined(_WIN32)
constexpr const char* kFolderVariables = "SPLAT_PRIORS_DIR and LOCALAPPDATA";
#else
constexpr const char* kFolderVariables = "SPLAT_PRIORS_DIR, XDG_DATA_HOME and HOME";
#endif

constexpr const char* kPriorsGetExamples =
    R"(
Exit status: 0 done, or there already; 1 not fetched; 2 wrong usage, or no hash is known; 4 there is no such preset, no
address of its model is known, or the file is another one.

Examples:
  vkrun priors get u2net
  vkrun priors get moge-2-vits --out models/ --json
)";

struct ModelGetOptions {
    std::string name, out;
    bool unverified = false, json = false;
};

int get_model(const ModelGetOptions& options) {
    const Json found = preset_json(options.name);
    const Json& preset = found.at("preset");
    const auto name = preset.at("file").value("name", "");
    if (PathName(name).text() != name)
        throw Failure(kBadData, "the file of preset '" + options.name + "' is called '" + name +
                                    "', expected a name without '/' that every system takes");
    const Download download = download_of(found, options.out);
    if (download.url.empty())
        throw Failure(kBadData, "no address of '" + name + "' is known; " +
                                    preset.value("note", std::string()));
    if (options.out.empty() && found.at("path").get<std::string>().starts_with("/" + name))
        throw Failure(kUsageError, std::string("none of ") + kFolderVariables +
                                       " names a folder for models: name one with --out");
    const Json fetched = fetch(download, options.unverified);
    if (options.json)
        print_json(fetched);
    else
        std::printf("%s\nlicence: %s\n", fetched_text(fetched).c_str(),
                    preset.value("licence", "").c_str());
    return kSuccess;
}

}  // namespace

void add_priors_get(CLI::App& priors, int& exit_code) {
    CLI::App* command = add_command(priors, "get", "Fetch the model of a preset.",
                                    std::string(kDownloadHelp) + kPriorsGetExamples);
    const auto options = std::make_shared<ModelGetOptions>();
    command->add_option("NAME", options->name, "Name of a preset, or JSON of your own")
        ->required()
        ->type_name("");
    add_download_options(*command, options->out, options->unverified,
                         "where\n'vkrun priors where NAME' says");
    add_json_flag(*command, options->json);
    command->callback([options, &exit_code] { exit_code = get_model(*options); });
}

}  // namespace vkrun

// vkrun priors where: presets, and where their models are had.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "core/os/path.h"
#include "vkrun/cli/command.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/table.h"
#include "vkrun/cli/text.h"
#include "vkrun/priors/preset_list.h"

namespace vkrun {
namespace {

constexpr const char* kPriorsWhereFooter =
    R"(Without NAME, lists the presets. With it, prints the model's address, file, size, licence and notes, and commands
that fetch it, go on after an interruption, and check it, as 'vkrun priors get NAME' does.

Exit status: 0 done, 2 wrong usage, 4 there is no such preset.

Examples:
  vkrun priors where
  vkrun priors where u2net
  vkrun priors where midas-small --json
)";

std::string maps_of(const Json& preset) {
    std::string maps;
    for (const Json& output : preset.at("outputs"))
        maps += (maps.empty() ? "" : ", ") + output.at("map").get<std::string>();
    return maps;
}

void print_presets() {
    Table table({"preset", "maps", ">size", "there", "what"});
    for (const std::string& name : preset_names()) {
        const Json found = preset_json(name);
        const Json& preset = found.at("preset");
        const Json& file = preset.at("file");
        std::error_code none;
        const bool there =
            std::filesystem::exists(splat::os::path_of(found.at("path").get<std::string>()), none);
        table.add({name, maps_of(preset),
                   file.contains("bytes") ? bytes_text(file.at("bytes").get<std::uint64_t>()) : "",
                   there ? "yes" : "no", preset.at("title")});
    }
    std::fputs(table.text().c_str(), stdout);
}

void print_preset(const Json& found) {
    const Json& preset = found.at("preset");
    const Json& file = preset.at("file");
    const auto line = [](const char* what, const std::string& text) {
        if (!text.empty()) std::printf("%-9s%s\n", what, text.c_str());
    };
    line("preset",
         preset.at("name").get<std::string>() + ": " + preset.at("title").get<std::string>());
    line("maps", maps_of(preset));
    line("address", file.value("url", "none is known"));
    line("size", file.contains("bytes")
                     ? std::to_string(file.at("bytes").get<std::uint64_t>()) + " bytes"
                     : "not known");
    line("sha256", file.value("sha256", "not known"));
    line("licence", preset.value("licence", ""));
    line("note", preset.value("note", ""));
    line("file", found.at("path"));
    const Download download = download_of(found);
    if (!download.url.empty())
        std::printf("\nFetch it, or go on fetching it:\n%s\n", fetch_commands(download).c_str());
}

int where(const std::string& name, bool json) {
    if (name.empty() && !json) {
        print_presets();
    } else if (name.empty()) {
        Json all = Json::array();
        for (const std::string& one : preset_names()) all.push_back(preset_json(one));
        print_json(all);
    } else if (json) {
        print_json(preset_json(name));
    } else {
        print_preset(preset_json(name));
    }
    return kSuccess;
}

}  // namespace

void add_priors_where(CLI::App& priors, int& exit_code) {
    CLI::App* command = add_command(
        priors, "where", "List the kinds of models, and where they are had.", kPriorsWhereFooter);
    const auto name = std::make_shared<std::string>();
    const auto json = std::make_shared<bool>(false);
    command->add_option("NAME", *name, "Name of a preset")->type_name("");
    add_json_flag(*command, *json);
    command->callback([name, json, &exit_code] { exit_code = where(*name, *json); });
}

}  // namespace vkrun

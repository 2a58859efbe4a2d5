#include "vkrun/cli/options.h"

#include <CLI/CLI.hpp>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/text.h"

namespace vkrun {

CLI::App* add_command(CLI::App& parent, const char* name, const char* sentence,
                      const std::string& footer) {
    CLI::App* command = parent.add_subcommand(name, sentence);
    command->group("Commands");
    command->footer(footer);
    return command;
}

void add_json_flag(CLI::App& command, bool& json) {
    command.add_flag("--json", json, "Print one JSON object on standard output");
}

void add_overwrite_flag(CLI::App& command, bool& overwrite, const char* what) {
    command.add_flag("--overwrite", overwrite, std::string("Replace ") + what + " if it exists");
}

void add_count_option(CLI::App& command, const char* name, std::uint32_t& value, const char* text,
                      int least, int most) {
    command.add_option(name, value, std::string(text) + "; " + std::to_string(value))
        ->type_name("N")
        ->check(CLI::Range(least, most).description(""));
}

void add_threads_option(CLI::App& command, std::uint32_t& threads) {
    command.add_option("--threads", threads, "Threads; 0: one for each core")
        ->type_name("N")
        ->check(CLI::Range(0, 256).description(""));
}

void add_changes_option(CLI::App& command, std::vector<std::string>& changes) {
    command.add_option("--set", changes, "Change a value of the configuration; may be repeated")
        ->type_name("KEY=VALUE")
        ->take_all()
        ->expected(1)
        ->allow_extra_args(false);
}

void check_number(const char* option, double value, double least, double most) {
    if (value >= least && value <= most) return;  // false for NaN
    throw Failure(kUsageError, format("%s is %g, expected %g to %g", option, value, least, most));
}

void check_background(const std::vector<float>& rgb) {
    for (const float value : rgb) check_number("--background", static_cast<double>(value), 0, 1);
}

}  // namespace vkrun

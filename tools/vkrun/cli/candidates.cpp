#include "vkrun/cli/candidates.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <set>
#include <sstream>

#include "vkrun/cli/options.h"

namespace vkrun {
namespace {

/// The command line up to the cursor.
struct Place {
    CLI::App* command = nullptr;
    CLI::Option* option = nullptr;  // whose values follow
    int values = 0;                 // how many it may still take
    int arguments = 0;              // how many the command has before the cursor
    bool options_end = false;       // after "--"
};

void add(std::string& lines, const std::string& word, const std::string& description) {
    lines += word + "\t" + description.substr(0, description.find('\n')) + "\n";
}

/// The option of that name, also of the commands above, which take theirs behind a command, too.
CLI::Option* option_named(CLI::App* command, const std::string& name) {
    for (; command != nullptr; command = command->get_parent())
        if (CLI::Option* option = command->get_option_no_throw(name)) return option;
    return nullptr;
}

CLI::App* command_named(CLI::App& parent, const std::string& name) {
    const auto found =
        parent.get_subcommands([&](CLI::App* each) { return each->get_name() == name; });
    return found.empty() ? nullptr : found.front();
}

void begin_option(Place& place, const std::string& word) {
    const std::size_t equals = word.find('=');
    place.option = option_named(place.command, word.substr(0, equals));
    place.values = place.option != nullptr && equals == std::string::npos
                       ? place.option->get_items_expected_max()
                       : 0;
}

void pass(Place& place, const std::string& word) {
    if (word == "=") return;  // bash takes "--name=value" for three words
    const bool dash = !place.options_end && word.size() > 1 && word[0] == '-';
    if (dash && word == "--") {
        place.options_end = true;
        place.values = 0;
    } else if (dash && (place.values == 0 || option_named(place.command, word) != nullptr)) {
        begin_option(place, word);
    } else if (place.values > 0) {
        --place.values;
    } else if (CLI::App* command = command_named(*place.command, word)) {
        place.command = command;
    } else {
        ++place.arguments;
    }
}

/// The argument of the command at the cursor, or null.
CLI::Option* argument_at(const Place& place) {
    int end = 0;
    for (CLI::Option* option : place.command->get_options()) {
        if (!option->get_positional()) continue;
        end += std::min(option->get_items_expected_max(), 1 << 20);
        if (place.arguments < end) return option;
    }
    return nullptr;
}

/// What an option or an argument may be: names of its values, else files or folders, as its name or its value's in the
/// help tells.
void add_values(std::string& lines, CLI::Option* option, const std::string& before) {
    const std::vector<std::string> words = words_of(*option);
    for (const std::string& word : words) add(lines, before + word, "");
    if (!words.empty()) return;
    const std::string kind =
        option->get_positional() ? option->get_name(true) : option->get_type_name();
    static const std::set<std::string> folders = {"DIR", "FOLDER", "RAW", "RUN"};
    static const std::set<std::string> files = {"A",  "B",   "CONFIG", "DATA",  "IMAGE",
                                                "IN", "OUT", "SCENE",  "TRUTH", "WEIGHTS"};
    if (folders.count(kind) != 0)
        lines += ":folders\n";
    else if (kind.find("FILE") != std::string::npos || files.count(kind) != 0)
        lines += ":files\n";
}

void add_options(std::string& lines, CLI::App* command) {
    std::set<std::string> seen;
    for (; command != nullptr; command = command->get_parent())
        for (const CLI::Option* option : command->get_options())
            for (const std::string& name : option->get_lnames())
                if (seen.insert(name).second) add(lines, "--" + name, option->get_description());
}

std::string all_at(const Place& place, const std::string& current) {
    std::string lines;
    const std::size_t equals = current.find('=');
    const bool dash = !place.options_end && current.starts_with("-");
    if (dash && equals != std::string::npos) {
        CLI::Option* option = option_named(place.command, current.substr(0, equals));
        if (option != nullptr) add_values(lines, option, current.substr(0, equals + 1));
    } else if (dash) {
        add_options(lines, place.command);
    } else if (place.values > 0) {
        add_values(lines, place.option, "");
    } else if (const auto commands = place.command->get_subcommands({}); !commands.empty()) {
        for (const CLI::App* command : commands)
            if (place.arguments == 0)  // else it is an unknown command
                add(lines, command->get_name(), command->get_description());
    } else if (CLI::Option* argument = argument_at(place)) {
        add_values(lines, argument, "");
    } else if (!place.options_end) {
        add_options(lines, place.command);
    }
    return lines;
}

}  // namespace

std::string candidates(CLI::App& app, std::vector<std::string> words) {
    std::string current = words.empty() ? "" : words.back();
    if (!words.empty()) words.pop_back();
    if (current == "\"\"") current = "";  // how PowerShell 7 hands over an empty word
    Place place;
    place.command = &app;
    for (const std::string& word : words) pass(place, word);
    std::istringstream all(all_at(place, current));
    std::string fitting;
    for (std::string line; std::getline(all, line);)
        if (line[0] == ':' || line.starts_with(current)) fitting += line + "\n";
    return fitting;
}

}  // namespace vkrun

#include "vkrun/cli/usage.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <vector>

#include "vkrun/cli/text.h"

namespace vkrun {
namespace {

/// The options or commands that could replace an unknown word.
std::vector<std::string> words_of(const CLI::App& command, bool options) {
    std::vector<std::string> words;
    if (options)
        for (const CLI::Option* option : command.get_options())
            for (const std::string& name : option->get_lnames()) words.push_back("--" + name);
    else
        for (const CLI::App* child : command.get_subcommands({}))
            words.push_back(child->get_name());
    return words;
}

/// The command that was being parsed when parsing stopped.
const CLI::App& innermost(const CLI::App& app) {
    const std::vector<CLI::App*> chosen = app.get_subcommands();
    return chosen.empty() ? app : innermost(*chosen.back());
}

/// "vkrun bench ops"
std::string path_of(const CLI::App& command) {
    const CLI::App* parent = command.get_parent();
    return (parent != nullptr ? path_of(*parent) + " " : "") + command.get_name();
}

/// "doctor, devices, predict": the commands below this one.
std::string command_list(const CLI::App& command) {
    std::string names;
    for (const std::string& name : words_of(command, false))
        names += (names.empty() ? "" : ", ") + name;
    return names;
}

bool is_option(const std::string& word) {
    return word.rfind('-', 0) == 0;
}

std::string problem(const CLI::App& app, const CLI::ParseError& error) {
    const CLI::App& command = innermost(app);
    const std::vector<std::string> unknown = app.remaining(true);
    const std::string commands = command_list(command);
    if (unknown.empty() && error.get_name() == "RequiredError" && !commands.empty())
        return "a command is missing; there are: " + commands;
    if (unknown.empty()) return error.what();
    const std::string& word = unknown.front();
    const bool option = is_option(word);
    std::string sentence =
        (option ? "unknown option '" : "unknown command or argument '") + word + "'";
    const std::vector<std::string> options = words_of(command, true);
    if (option && std::find(options.begin(), options.end(), word) != options.end())
        return "'" + word + "' follows '--', after which words are files: put options before it";
    const std::string nearest =
        nearest_word(word.substr(0, word.find('=')), words_of(command, option));
    if (!nearest.empty()) return sentence + "; did you mean '" + nearest + "'?";
    return option || commands.empty() ? sentence : sentence + "; there are: " + commands;
}

}  // namespace

bool has_unknown_command(const CLI::App& app) {
    const std::vector<std::string> unknown = app.remaining(true);
    return !innermost(app).get_subcommands({}).empty() &&
           std::any_of(unknown.begin(), unknown.end(),
                       [](const std::string& word) { return !is_option(word); });
}

std::string usage_sentence(const CLI::App& app, const CLI::ParseError& error) {
    return problem(app, error) + "\n       see '" + path_of(innermost(app)) + " --help'";
}

}  // namespace vkrun

#include "vkrun/cli/options.h"

#include <CLI/CLI.hpp>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/text.h"

namespace vkrun {
namespace {

// The name of a check is kept by CLI11, and shown nowhere.
const std::string kWords = "words: ";

/// Leaves out checks and "Needs" and "Excludes", which descriptions state where they matter.
class HelpFormatter : public CLI::Formatter {
  public:
    std::string make_option_opts(const CLI::Option* option) const override {
        std::string text;
        if (option->get_type_size() != 0 && !option->get_type_name().empty())
            text += " " + option->get_type_name();
        if (option->get_required()) text += " REQUIRED";
        return text;
    }

    std::string make_option_desc(const CLI::Option* option) const override {
        const std::string value = option->get_default_str();
        return option->get_description() + (value.empty() ? "" : "; default: " + value);
    }
};

}  // namespace

std::shared_ptr<CLI::Formatter> help_formatter() {
    auto formatter = std::make_shared<HelpFormatter>();
    formatter->column_width(28);
    formatter->label("SUBCOMMAND", "COMMAND");
    return formatter;
}

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
    command.add_option(name, value, text)
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(least, most).description(""));
}

void add_threads_option(CLI::App& command, std::uint32_t& threads) {
    command.add_option("--threads", threads, "Number of threads; 0: one per core")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(0, 256).description(""));
}

void add_changes_option(CLI::App& command, std::vector<std::string>& changes) {
    command.add_option("--set", changes, "Change a value of the configuration; may be repeated")
        ->type_name("KEY=VALUE")
        ->take_all()
        ->expected(1)
        ->allow_extra_args(false);
}

void add_allow_missing_flag(CLI::App& command, bool& allow) {
    command.add_flag("--allow-missing", allow,
                     "Leave objects out that lack a file, and name them, instead of refusing them");
}

CLI::Validator one_of(const std::vector<std::string>& words) {
    CLI::Validator check = CLI::IsMember(words);
    return check.description("").name(kWords + CLI::detail::join(words));
}

CLI::Validator any_like(const std::vector<std::string>& words) {
    const auto accept = [](const std::string&) { return std::string(); };
    return CLI::Validator(accept, "", kWords + CLI::detail::join(words));
}

std::vector<std::string> words_of(CLI::Option& option) {
    try {
        for (int i = 0;; ++i) {
            const std::string name = option.get_validator(i)->get_name();
            if (name.starts_with(kWords))
                return CLI::detail::split(name.substr(kWords.size()), ',');
        }
    } catch (const CLI::OptionNotFound&) {  // there is no further check
        return {};
    }
}

void check_number(const char* option, double value, double least, double most) {
    if (value >= least && value <= most) return;  // false for NaN
    throw Failure(kUsageError, format("%s is %g, expected %g to %g", option, value, least, most));
}

void check_background(const std::vector<float>& rgb) {
    for (const float value : rgb) check_number("--background", static_cast<double>(value), 0, 1);
}

}  // namespace vkrun

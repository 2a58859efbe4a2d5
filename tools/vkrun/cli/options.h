#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace CLI {
class App;
class Formatter;
class Option;
class Validator;
}  // namespace CLI

namespace vkrun {

/// The layout of all help texts: an option shows its value, and its default behind the description.
std::shared_ptr<CLI::Formatter> help_formatter();

/// A command below `parent`, in the list "Commands" of its help.
CLI::App* add_command(CLI::App& parent, const char* name, const char* sentence,
                      const std::string& footer);

// ---- Options that several commands have

void add_json_flag(CLI::App& command, bool& json);

/// what  the argument whose file may be replaced
void add_overwrite_flag(CLI::App& command, bool& overwrite, const char* what);

/// A whole number from `least` to `most`; `value` is its default, which the help names.
void add_count_option(CLI::App& command, const char* name, std::uint32_t& value, const char* text,
                      int least, int most);

/// --threads, 0 for one per core.
void add_threads_option(CLI::App& command, std::uint32_t& threads);

/// --set KEY=VALUE, any number of times.
void add_changes_option(CLI::App& command, std::vector<std::string>& changes);

/// --allow-missing
void add_allow_missing_flag(CLI::App& command, bool& allow);

// ---- Checks of their values

/// The value is one of these words, which `words_of` tells.
CLI::Validator one_of(const std::vector<std::string>& words);

/// Any value; a shell offers these words.
CLI::Validator any_like(const std::vector<std::string>& words);

/// The words of a check by `one_of` or `any_like`; none without one.
std::vector<std::string> words_of(CLI::Option& option);

/// Throws a usage Failure, "--distance is nan, expected ...", unless the value is in the range.
void check_number(const char* option, double value, double least, double most);

/// The same for a colour of three numbers from 0 to 1.
void check_background(const std::vector<float>& rgb);

}  // namespace vkrun

// vkrun config: the keys of configurations, and the values of a configuration. Needs no device.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>

#include "core/os/path.h"
#include "vkrun/cli/command.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/text.h"
#include "vkrun/config/merged_config.h"

namespace vkrun {
namespace {

constexpr std::size_t kLineColumns = 100;

constexpr const char* kListFooter =
    R"(Lists each key with its type, default and range, and with its origin: the published code (Splatter
Image, or its fork with priors) or libsplat. PREFIX is a section or the start of keys: 'opt', 'opt.ema'.

Exit status: 0 done, 2 wrong usage, or no key starts with PREFIX.

Examples:
  vkrun config list opt
  vkrun config list --json | jq -r '.[] | select(.origin == "ours").key'
)";

constexpr const char* kConfigShowFooter =
    R"(Prints every value of CONFIG, or of the published cars model, and its source: the default, the file or
--set. '-' stands for a key without a value in this configuration. Warnings name what a training would
leave out, or why it is refused. With a KEY instead of CONFIG, prints the row of the key: type, range,
default, origin, meaning, and whether 'train --resume' takes another value.

Exit status: 0 done, 2 wrong usage, or a configuration that cannot be read.

Examples:
  vkrun config show cars.yaml --set opt.base_lr=1e-4
  vkrun config show opt.base_lr
)";

constexpr const char* kPresetsFooter =
    R"(Lists the configurations of the published models, and "small", a first training that ends within minutes.
Their names stand for files wherever a command takes a configuration. They name no folder of data, lists of
objects or weights: see --data, 'vkrun config list data' and opt.pretrained_ckpt.

Exit status: 0 done, 2 wrong usage.

Examples:
  vkrun config presets --json | jq -r '.[].name'
  vkrun train chairs --data srn_chairs --out run
  vkrun config show nmr --set opt.batch_size=8
)";

struct ConfigOptions {
    std::string prefix;  ///< a prefix, CONFIG or KEY
    std::vector<std::string> changes;
    bool json = false;
};

Json all_rows() {
    return library_json(splat_config_keys);
}

std::string text_of(const Json& row, const char* member) {
    return row.at(member).get<std::string>();
}

std::string section_of(const std::string& key) {
    return key.substr(0, key.find('.'));
}

/// A value as --set takes it.
std::string value_text(const Json& value) {
    if (value.is_null()) return "-";
    if (value.is_string() && !value.get<std::string>().empty()) return value.get<std::string>();
    if (!value.is_array()) return value.dump();
    std::string text;
    for (const Json& each : value) text += (text.empty() ? "" : ", ") + value_text(each);
    return "[" + text + "]";
}

/// The default of a key; numbers in the fewest digits that read back as the same float.
std::string default_text(const Json& row) {
    const Json& value = row.at("default");
    if (!value.is_number_float()) return value_text(value);
    const auto number = value.get<double>();
    std::string text;
    for (int digits = 1; digits <= 9; ++digits) {
        text = format("%.*g", digits, number);
        if (std::strtof(text.c_str(), nullptr) == static_cast<float>(number)) break;
    }
    return text;
}

/// One line with a cell at each stop, or behind a longer one before it.
std::string line_of(const std::vector<std::pair<std::size_t, std::string>>& cells) {
    std::string line;
    for (const auto& [stop, cell] : cells) {
        if (!line.empty()) line += ' ';
        line.resize(std::max(line.size(), stop), ' ');
        line += cell;
    }
    return line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
}

std::string wrapped(const std::string& sentence, std::size_t indent) {
    std::string text;
    std::string line;
    for (std::size_t at = 0; at < sentence.size();) {
        const std::size_t end = std::min(sentence.find(' ', at), sentence.size());
        const std::string word = sentence.substr(at, end - at);
        if (!line.empty() && indent + line.size() + 1 + word.size() > kLineColumns) {
            text += std::string(indent, ' ') + line + "\n";
            line.clear();
        }
        line += (line.empty() ? "" : " ") + word;
        at = end + 1;
    }
    return text + std::string(indent, ' ') + line + "\n";
}

std::string about(const Json& row) {
    return text_of(row, "about") + (row.at("effect") ? "" : " Accepted, without effect.");
}

/// Throws a usage Failure with the library's sentence, which has the nearest name.
[[noreturn]] void refuse_unknown(const std::string& word) {
    const std::string change = word + "=null";
    const char* const values[] = {change.c_str()};
    std::size_t needed = 0;
    if (splat_config_merge(nullptr, values, 1, nullptr, 0, &needed) < 0)
        throw Failure(kUsageError, library_message());
    throw Failure(kUsageError, "no key starts with '" + word + "'");
}

int list(const ConfigOptions& options) {
    Json rows = Json::array();
    for (const Json& row : all_rows())
        if (text_of(row, "key").starts_with(options.prefix)) rows.push_back(row);
    if (rows.empty()) refuse_unknown(options.prefix);
    if (options.json) {
        print_json(rows);
        return kSuccess;
    }
    std::string text =
        line_of({{0, "key"}, {31, "type"}, {48, "default"}, {65, "range"}, {88, "origin"}});
    std::string section;
    for (const Json& row : rows) {
        const std::string key = text_of(row, "key");
        if (section_of(key) != section) text += "\n";
        section = section_of(key);
        text += line_of({{0, key},
                         {31, text_of(row, "type")},
                         {48, default_text(row)},
                         {65, text_of(row, "range")},
                         {88, text_of(row, "origin")}});
        text += wrapped(about(row), 4);
    }
    std::fputs(text.c_str(), stdout);
    return kSuccess;
}

void explain(const Json& row, bool json) {
    if (json) {
        print_json(row);
        return;
    }
    const std::string range = text_of(row, "range");
    std::string text = text_of(row, "key") + "\n" + wrapped(about(row), 2) + "\n";
    text += line_of({{2, "type"}, {11, text_of(row, "type")}});
    if (!range.empty()) text += line_of({{2, "range"}, {11, range}});
    text += line_of({{2, "default"}, {11, default_text(row)}});
    text += line_of({{2, "origin"}, {11, text_of(row, "origin")}});
    if (row.at("effect"))
        text += line_of(
            {{2, "resume"}, {11, row.at("resumable") ? "takes another value" : "keeps the value"}});
    std::fputs(text.c_str(), stdout);
}

/// The value of a key in a configuration; null if the configuration does not have it.
Json value_in(const Json& config, const std::string& key) {
    const Json* at = &config;
    for (std::size_t from = 0; from <= key.size();) {
        const std::size_t end = std::min(key.find('.', from), key.size());
        const auto found = at->find(key.substr(from, end - from));
        if (found == at->end()) return nullptr;
        at = &*found;
        from = end + 1;
    }
    return *at;
}

int list_presets(bool json) {
    const Json rows = library_json(splat_config_presets);
    if (json) {
        print_json(rows);
        return kSuccess;
    }
    for (const Json& row : rows)
        std::fputs(line_of({{0, text_of(row, "name")}, {20, text_of(row, "about")}}).c_str(),
                   stdout);
    return kSuccess;
}

/// The configuration without the changes of --set; null if it is wrong without them.
Json unchanged_config(const ConfigOptions& options) try {
    return merged_config(options.prefix, {});
} catch (const Failure&) {
    return nullptr;
}

/// Print what a training would leave out, or why it is refused, to standard error.
void warn_of_training(const ConfigOptions& options) {
    const std::string text = options.prefix.empty() ? "" : config_text(options.prefix);
    const char* const from = options.prefix.empty() ? nullptr : text.c_str();
    std::vector<const char*> values;
    for (const std::string& change : options.changes) values.push_back(change.c_str());
    std::size_t needed = 0;
    if (splat_config_check(from, values.data(), values.size(), nullptr, 0, &needed) < 0) {
        std::fprintf(stderr, "vkrun: warning: a training is refused: %s\n",
                     library_message().c_str());
        return;
    }
    const Json told = library_json(splat_config_check, from, values.data(), values.size());
    for (const Json& warning : told.at("warnings"))
        std::fprintf(stderr, "vkrun: warning: %s\n", warning.get<std::string>().c_str());
}

/// Each key with its value, and the source of the value.
Json show_values(const ConfigOptions& options, const Json& rows) {
    const Json merged = merged_config(options.prefix, options.changes);
    const Json file = unchanged_config(options);
    Json shown = Json::array();
    for (const Json& row : rows) {
        const std::string key = text_of(row, "key");
        const Json value = value_in(merged, key);
        bool named = false;
        for (const std::string& change : options.changes)
            named = named || change.substr(0, change.find('=')) == key;
        const char* source = "default";
        if (value.is_null())
            source = "none";
        else if (named)
            source = "set";
        else if (value != row.at("default"))
            source = file.is_null() || value == value_in(file, key) ? "file" : "set";
        shown.push_back({{"key", key}, {"value", value}, {"source", source}});
    }
    return shown;
}

/// The row of `word`, or null where it names a configuration. Throws a usage Failure for a word
/// that looks like a key but is unknown.
Json row_of(const std::string& word, const Json& rows) {
    std::error_code ignored;
    if (word.empty() || std::filesystem::exists(splat::os::path_of(word), ignored)) return nullptr;
    bool key_like = false;
    for (const Json& row : rows) {
        const std::string key = text_of(row, "key");
        if (key == word) return row;
        if (section_of(key) == word)
            throw Failure(kUsageError,
                          "'" + word + "' is a section; see 'vkrun config list " + word + "'");
        key_like = key_like || word.starts_with(section_of(key) + ".");
    }
    if (key_like) refuse_unknown(word);
    return nullptr;
}

int show(const ConfigOptions& options) {
    const Json rows = all_rows();
    if (const Json row = row_of(options.prefix, rows); !row.is_null()) {
        explain(row, options.json);
        return kSuccess;
    }
    const Json shown = show_values(options, rows);
    warn_of_training(options);
    if (options.json) {
        print_json(shown);
        return kSuccess;
    }
    std::string text = line_of({{0, "key"}, {31, "value"}, {88, "source"}});
    std::string section;
    for (std::size_t i = 0; i < shown.size(); ++i) {
        const std::string key = text_of(shown[i], "key");
        if (section_of(key) != section) text += "\n";
        section = section_of(key);
        const std::string source = text_of(shown[i], "source");
        text += line_of(
            {{0, key},
             {31, source == "default" ? default_text(rows[i]) : value_text(shown[i].at("value"))},
             {88, source == "none" ? "" : source}});
    }
    std::fputs(text.c_str(), stdout);
    return kSuccess;
}

}  // namespace

void add_config(CLI::App& app, int& exit_code) {
    CLI::App* group =
        add_command(app, "config", "List the keys of configurations, or show a configuration.",
                    "'vkrun config COMMAND --help' describes a command.\n");
    group->require_subcommand(1);
    const auto options = std::make_shared<ConfigOptions>();
    CLI::App* all = add_command(*group, "list", "List every key with its type, range and default.",
                                kListFooter);
    all->add_option("PREFIX", options->prefix, "Only keys that start with PREFIX")->type_name("");
    add_json_flag(*all, options->json);
    all->callback([options, &exit_code] { exit_code = list(*options); });
    CLI::App* presets =
        add_command(*group, "presets", "List the configurations that have names.", kPresetsFooter);
    add_json_flag(*presets, options->json);
    presets->callback([options, &exit_code] { exit_code = list_presets(options->json); });
    CLI::App* one = add_command(*group, "show", "Show every value of a configuration, or one key.",
                                kConfigShowFooter);
    one->add_option("CONFIG", options->prefix,
                    "YAML or JSON file, name of a preset, or a KEY; default: the cars model")
        ->type_name("");
    add_changes_option(*one, options->changes);
    add_json_flag(*one, options->json);
    one->callback([options, &exit_code] { exit_code = show(*options); });
}

}  // namespace vkrun

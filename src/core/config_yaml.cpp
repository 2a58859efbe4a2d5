#include <yaml.h>

#include <limits>
#include <optional>

#include "core/config.h"
#include "core/json.h"
#include "core/no_copy.h"
#include "core/number_in.h"

namespace splat {
namespace {

/// An event of the parser, freed at the end.
class Event : NoCopy {
  public:
    ~Event() { yaml_event_delete(&event_); }

    yaml_event_t* operator->() { return &event_; }
    yaml_event_t* get() { return &event_; }

  private:
    yaml_event_t event_{};
};

std::optional<bool> bool_of(std::string_view text) {
    for (const std::string_view yes :
         {"true", "True", "TRUE", "yes", "Yes", "YES", "on", "On", "ON"})
        if (text == yes) return true;
    for (const std::string_view no :
         {"false", "False", "FALSE", "no", "No", "NO", "off", "Off", "OFF"})
        if (text == no) return false;
    return std::nullopt;
}

bool is_digits(std::string_view text) {
    return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

/// A number, or nothing: "12", "-1.5", ".5", "1e-5", ".inf". Other spellings of YAML (octal,
/// hexadecimal, sexagesimal) stay texts, because they are usually meant as text.
std::optional<ConfigScalar> number_of(std::string_view text) {
    std::string_view size = text;
    const bool negative = size.starts_with('-');
    if (negative || size.starts_with('+')) size.remove_prefix(1);
    if (size == ".inf" || size == ".Inf" || size == ".INF")
        return (negative ? -1 : 1) * std::numeric_limits<double>::infinity();
    if (text == ".nan" || text == ".NaN" || text == ".NAN")
        return std::numeric_limits<double>::quiet_NaN();
    if (is_digits(size) && (size == "0" || size[0] != '0')) {
        if (const auto whole = number_in<std::int64_t>(negative ? text : size)) return *whole;
    }
    const std::string_view start = size.substr(size.starts_with('.') ? 1 : 0, 1);
    if (!is_digits(start) || size.find_first_not_of("0123456789.eE+-") != std::string_view::npos)
        return std::nullopt;
    if (size.size() > 1 && size[0] == '0' && is_digits(size)) return std::nullopt;
    const auto value = number_in<double>(size);
    if (!value) return std::nullopt;
    return negative ? -*value : *value;
}

ConfigScalar scalar_of(std::string_view text, bool plain) {
    if (!plain) return std::string(text);
    if (text.empty() || text == "~" || text == "null" || text == "Null" || text == "NULL")
        return std::monostate();
    if (const auto flag = bool_of(text)) return *flag;
    if (const auto number = number_of(text)) return *number;
    return std::string(text);
}

class YamlReader : NoCopy {
  public:
    YamlReader(std::string_view text, const std::string& what) : config_(what) {
        started_ = yaml_parser_initialize(&parser_) == 1;
        if (!started_) return;
        yaml_parser_set_encoding(&parser_, YAML_UTF8_ENCODING);
        yaml_parser_set_input_string(&parser_, reinterpret_cast<const unsigned char*>(text.data()),
                                     text.size());
    }
    ~YamlReader() {
        if (started_) yaml_parser_delete(&parser_);
    }

    Result<Config> run() {
        if (!started_) return error(Code::kOutOfHostMemory, "the YAML parser did not start");
        while (true) {
            Event event;
            if (yaml_parser_parse(&parser_, event.get()) != 1) return broken();
            line_ = event->start_mark.line + 1;
            if (event->type == YAML_STREAM_END_EVENT) return std::move(config_);
            SPLAT_TRY(take(*event.get()));
        }
    }

  private:
    /// An open map or list, and for a map the key whose value comes next.
    struct Level {
        std::string prefix;
        bool list = false;
        std::size_t index = 0;
        std::optional<std::string> key = {};
    };

    [[nodiscard]] Status bad(const std::string& problem, Code code = Code::kInvalidArgument) const {
        return error(code, "%s: line %zu: %s", config_.what().c_str(), line_, problem.c_str());
    }

    Status broken() {
        if (parser_.error == YAML_MEMORY_ERROR)
            return error(Code::kOutOfHostMemory, "%s: no memory to parse it",
                         config_.what().c_str());
        line_ = parser_.problem_mark.line + 1;
        return bad(std::string("not valid YAML: ") +
                   (parser_.problem != nullptr ? parser_.problem : "unknown problem"));
    }

    Status take(const yaml_event_t& event) {
        switch (event.type) {
            case YAML_DOCUMENT_START_EVENT:
                return documents_++ == 0 ? Status() : bad("a second document");
            case YAML_SCALAR_EVENT: {
                const auto& scalar = event.data.scalar;
                SPLAT_TRY(check_properties(scalar.anchor, scalar.tag));
                return take_scalar({reinterpret_cast<const char*>(scalar.value), scalar.length},
                                   scalar.style == YAML_PLAIN_SCALAR_STYLE);
            }
            case YAML_MAPPING_START_EVENT:
                SPLAT_TRY(check_properties(event.data.mapping_start.anchor,
                                           event.data.mapping_start.tag));
                return open(false);
            case YAML_SEQUENCE_START_EVENT:
                SPLAT_TRY(check_properties(event.data.sequence_start.anchor,
                                           event.data.sequence_start.tag));
                return open(true);
            case YAML_MAPPING_END_EVENT:
            case YAML_SEQUENCE_END_EVENT:
                levels_.pop_back();
                return {};
            case YAML_ALIAS_EVENT:
                return bad("aliases (*name) are not read", Code::kUnsupported);
            default:
                return {};
        }
    }

    Status check_properties(const yaml_char_t* anchor, const yaml_char_t* tag) const {
        if (anchor != nullptr) return bad("anchors (&name) are not read", Code::kUnsupported);
        if (tag != nullptr) return bad("tags (!name) are not read", Code::kUnsupported);
        return {};
    }

    /// The key of the next value.
    std::string next_key() {
        Level& level = levels_.back();
        const std::string name = level.list ? std::to_string(level.index++) : *level.key;
        level.key.reset();
        return level.prefix.empty() ? name : level.prefix + "." + name;
    }

    Status open(bool list) {
        if (levels_.size() == static_cast<std::size_t>(kMaxConfigDepth))
            return bad("it nests deeper than " + std::to_string(kMaxConfigDepth) + " levels");
        if (levels_.empty()) {
            if (list) return bad("a list, expected a map of keys");
            levels_.push_back({"", false});
            return {};
        }
        if (!levels_.back().list && !levels_.back().key) return bad("a key that is not a scalar");
        const std::string key = next_key();
        SPLAT_TRY(add({key, {}, list, !list}));
        levels_.push_back({key, list});
        return {};
    }

    Status take_scalar(std::string_view text, bool plain) {
        if (text.find('\0') != std::string_view::npos)
            return bad("an escaped NUL (\\0), expected a text without one");
        if (levels_.empty()) {
            if (plain && text.empty()) return {};  // an empty document
            return bad("a scalar, expected a map of keys");
        }
        Level& level = levels_.back();
        if (level.list) {
            ++level.index;
            return config_.append(level.prefix, scalar_of(text, plain));
        }
        if (!level.key) {
            if (plain && text == "<<")
                return bad("merge keys (<<) are not read", Code::kUnsupported);
            level.key = std::string(text);
            return {};
        }
        return add({next_key(), {scalar_of(text, plain)}});
    }

    Status add(ConfigEntry entry) {
        const Status added = config_.add(std::move(entry));
        if (added.ok()) return added;
        return {added.code(), added.message() + " (line " + std::to_string(line_) + ")"};
    }

    yaml_parser_t parser_{};
    bool started_ = false;
    Config config_;
    std::vector<Level> levels_;
    std::size_t line_ = 0;
    int documents_ = 0;
};

}  // namespace

Result<Config> read_yaml_config(std::string_view text, const std::string& what) {
    if (text.size() > kMaxConfigBytes)
        return invalid("%s: %zu bytes of YAML, expected at most %zu", what.c_str(), text.size(),
                       kMaxConfigBytes);
    SPLAT_TRY(check_no_nul(text, what.c_str()));
    return YamlReader(text, what).run();
}

}  // namespace splat

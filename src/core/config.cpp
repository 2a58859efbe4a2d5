#include "core/config.h"

#include <algorithm>
#include <numeric>

#include "core/c_locale.h"
#include "core/json_writer.h"
#include "core/shown.h"

namespace splat {
namespace {

constexpr std::size_t kMaxWord = 200;

const char* kind_of(const ConfigScalar& value) {
    constexpr const char* kKinds[] = {"null", "a bool", "a whole number", "a number", "a text"};
    return kKinds[value.index()];
}

template <class T>
bool convert(const ConfigScalar& value, T& to) {
    if (const T* same = std::get_if<T>(&value)) {
        to = *same;
        return true;
    }
    if constexpr (std::is_same_v<T, double>)
        if (const auto* whole = std::get_if<std::int64_t>(&value)) {
            to = static_cast<double>(*whole);
            return true;
        }
    return false;
}

template <class T>
const char* wanted() {
    return kind_of(ConfigScalar(T{}));
}

/// "a" of "a.b.0.c"
std::string section_of(const std::string& key) {
    return key.substr(0, key.find('.'));
}

bool is_in(const std::string& word, const std::vector<std::string>& words) {
    return std::ranges::find(words, word) != words.end();
}

/// `kind`: "key", "section"
Status unknown(const std::string& what, const char* kind, const std::string& word,
               const std::vector<std::string>& known) {
    const std::string nearest = nearest_name(word, known);
    const std::string hint = nearest.empty() ? "" : "; did you mean '" + nearest + "'?";
    return invalid("%s: there is no %s '%s'%s", what.c_str(), kind, shown(word).c_str(),
                   hint.c_str());
}

/// "a.b.0.c"
std::string key_of(std::span<const JsonStep> path) {
    std::string key;
    for (const JsonStep& step : path)
        key += (key.empty() ? "" : ".") + (step.array ? std::to_string(step.index) : step.key);
    return key;
}

ConfigScalar scalar_of(const JsonEvent& event) {
    switch (event.kind) {
        case JsonEvent::Kind::kBool:
            return event.integer != 0;
        case JsonEvent::Kind::kInteger:
            return event.integer;
        case JsonEvent::Kind::kReal:
            return event.real;
        case JsonEvent::Kind::kText:
            return std::string(event.text);
        case JsonEvent::Kind::kNull:
        case JsonEvent::Kind::kObject:
        case JsonEvent::Kind::kArray:
            break;
    }
    return {};
}

}  // namespace

Status Config::add(ConfigEntry entry) {
    if (entries_.size() == kMaxConfigEntries)
        return invalid("%s: more than %zu keys", what_.c_str(), kMaxConfigEntries);
    if (entry.key.size() > kMaxConfigKey)
        return invalid("%s: a key of %zu letters, '%.40s...', the limit is %zu", what_.c_str(),
                       entry.key.size(), entry.key.c_str(), kMaxConfigKey);
    if (!places_.emplace(entry.key, entries_.size()).second)
        return invalid("%s: the key '%s' appears twice", what_.c_str(), shown(entry.key).c_str());
    entries_.push_back(std::move(entry));
    return {};
}

Status Config::append(const std::string& key, ConfigScalar value) {
    const auto place = places_.find(key);
    if (place == places_.end() || !entries_[place->second].list)
        return invalid("%s: '%s' is not a list", what_.c_str(), key.c_str());
    entries_[place->second].values.push_back(std::move(value));
    return {};
}

void Config::set(ConfigEntry entry) {
    const auto place = places_.find(entry.key);
    if (place != places_.end()) {
        entries_[place->second] = std::move(entry);
        return;
    }
    places_.emplace(entry.key, entries_.size());
    entries_.push_back(std::move(entry));
}

const ConfigEntry* Config::find(const std::string& key) const {
    const auto place = places_.find(key);
    return place == places_.end() ? nullptr : &entries_[place->second];
}

template <class T>
Result<T> Config::get(const std::string& key, T otherwise) const {
    const ConfigEntry* entry = find(key);
    if (entry == nullptr) return otherwise;
    const bool one = !entry->list && !entry->map;
    if (one && entry->values[0].index() == 0) return otherwise;
    if (one && convert(entry->values[0], otherwise)) return otherwise;
    const char* const got =
        one ? kind_of(entry->values[0]) : (entry->list ? "a list" : "a map of further keys");
    return invalid("%s: '%s' is %s, expected %s", what_.c_str(), key.c_str(), got, wanted<T>());
}

template <class T>
Result<std::vector<T>> Config::get_list(const std::string& key, std::vector<T> otherwise) const {
    const ConfigEntry* entry = find(key);
    if (entry == nullptr) return otherwise;
    if (!entry->list) {
        if (!entry->map && entry->values[0].index() == 0) return otherwise;
        return invalid("%s: '%s' is not a list", what_.c_str(), key.c_str());
    }
    std::vector<T> values;
    for (const ConfigScalar& scalar : entry->values) {
        T value{};
        if (!convert(scalar, value))
            return invalid("%s: the list '%s' holds %s, expected %s", what_.c_str(), key.c_str(),
                           kind_of(scalar), wanted<T>());
        values.push_back(std::move(value));
    }
    return values;
}

#define SPLAT_CONFIG_TYPE(T)                                                      \
    template Result<T> Config::get<T>(const std::string& key, T otherwise) const; \
    template Result<std::vector<T>> Config::get_list<T>(const std::string& key,   \
                                                        std::vector<T> otherwise) const;
SPLAT_CONFIG_TYPE(std::int64_t)
SPLAT_CONFIG_TYPE(double)
SPLAT_CONFIG_TYPE(std::string)
template Result<bool> Config::get<bool>(const std::string& key, bool otherwise) const;
#undef SPLAT_CONFIG_TYPE

Status Config::refuse_unknown(const std::vector<std::string>& known,
                              const std::vector<std::string>& sections) const {
    for (const ConfigEntry& entry : entries_) {
        const std::string section = section_of(entry.key);
        if (!is_in(section, sections) || is_in(entry.key, known)) continue;
        if (section == entry.key) {
            if (entry.map || (!entry.list && entry.values[0].index() == 0))
                continue;  // null: empty
            return invalid("%s: '%s' is %s, expected keys below it", what_.c_str(), section.c_str(),
                           entry.list ? "a list" : kind_of(entry.values[0]));
        }
        const bool leads_on = entry.map && std::ranges::any_of(known, [&](auto& key) {
                                  return key.starts_with(entry.key + ".");
                              });
        if (!leads_on) return unknown(what_, "key", entry.key, known);
    }
    return {};
}

Status Config::refuse_unknown_sections(const std::vector<std::string>& known) const {
    for (const ConfigEntry& entry : entries_)
        if (const std::string section = section_of(entry.key); !is_in(section, known))
            return unknown(what_, "section", section, known);
    return {};
}

Result<Config> read_json_config(std::string_view text, const std::string& what) {
    Config config(what);
    const Status status = visit_json(text, what.c_str(), [&config](const JsonEvent& event) {
        using Kind = JsonEvent::Kind;
        const bool opens = event.kind == Kind::kObject || event.kind == Kind::kArray;
        if (event.path.empty() && event.kind == Kind::kObject) return Status();
        if (event.path.empty()) return invalid("%s: expected a JSON object", config.what().c_str());
        if (event.path.back().array && !opens)
            return config.append(key_of(event.path.first(event.path.size() - 1)), scalar_of(event));
        ConfigEntry entry{
            key_of(event.path), {}, event.kind == Kind::kArray, event.kind == Kind::kObject};
        if (!opens) entry.values.push_back(scalar_of(event));
        return config.add(std::move(entry));
    });
    if (!status.ok()) return status;
    return config;
}

Result<Config> read_config(std::string_view text, const std::string& what) {
    const std::size_t first = text.find_first_not_of(" \t\r\n");
    if (first != std::string_view::npos && text[first] == '{') return read_json_config(text, what);
    return read_yaml_config(text, what);
}

namespace {

void write_scalar(JsonWriter& json, const ConfigScalar& value) {
    if (const auto* flag = std::get_if<bool>(&value)) {
        json.value(*flag);
    } else if (const auto* whole = std::get_if<std::int64_t>(&value)) {
        json.value(*whole);
    } else if (const auto* real = std::get_if<double>(&value)) {
        // 17 digits restore every double; the shortest text that does is easier to read.
        int digits = 6;
        while (digits < 17 && decimal_number(format("%.*g", digits, *real)) != *real) ++digits;
        json.number(*real, digits);
    } else if (const auto* text = std::get_if<std::string>(&value)) {
        json.value(*text);
    } else {
        json.raw("null");
    }
}

void write_entry(JsonWriter& json, const ConfigEntry& entry) {
    if (entry.map) {
        json.begin_object().end();
    } else if (entry.list) {
        json.begin_array();
        for (const ConfigScalar& value : entry.values) write_scalar(json, value);
        json.end();
    } else {
        write_scalar(json, entry.values[0]);
    }
}

/// The members of the map or list whose keys start with `prefix`, which ends in a dot or is empty.
void write_map(JsonWriter& json, const std::vector<ConfigEntry>& entries, const std::string& prefix,
               int indent, bool list = false) {
    std::vector<std::string> done;
    list ? json.begin_array() : json.begin_object();
    for (const ConfigEntry& entry : entries) {
        if (!entry.key.starts_with(prefix)) continue;
        const std::string name =
            entry.key.substr(prefix.size(), entry.key.find('.', prefix.size()) - prefix.size());
        if (is_in(name, done)) continue;
        done.push_back(name);
        const std::string inside = prefix + name + ".";
        const bool nested = std::ranges::any_of(
            entries, [&](const ConfigEntry& e) { return e.key.starts_with(inside); });
        json.newline(indent + 2);
        if (!list) json.key(name);
        if (nested)
            write_map(json, entries, inside, indent + 2,
                      entry.key == prefix + name && entry.list && entry.values.empty());
        else
            write_entry(json, entry);
    }
    json.newline(indent).end();
}

}  // namespace

std::string config_value_text(const ConfigEntry& entry) {
    JsonWriter json;
    write_entry(json, entry);
    return json.text();
}

std::string config_json(const Config& config) {
    JsonWriter json;
    write_map(json, config.entries(), "", 0);
    return json.text() + "\n";
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 0; i < a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i + 1;
        for (std::size_t j = 0; j < b.size(); ++j) {
            const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
            diagonal = row[j + 1];
            row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
        }
    }
    return row.back();
}

std::string nearest_name(const std::string& word, const std::vector<std::string>& known) {
    if (word.size() > kMaxWord) return "";
    std::string nearest;
    std::size_t least = std::max<std::size_t>(2, word.size() / 3) + 1;
    for (const std::string& candidate : known)
        if (const std::size_t distance = edit_distance(word, candidate); distance < least) {
            least = distance;
            nearest = candidate;
        }
    return nearest;
}

}  // namespace splat

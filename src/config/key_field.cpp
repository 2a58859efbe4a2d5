#include "config/key_field.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/c_locale.h"
#include "core/shown.h"

namespace splat::config {
namespace {

bool in_range(const Values& values, double value) {
    return std::isfinite(value) && (values.above ? value > values.least : value >= values.least) &&
           (values.below ? value < values.most : value <= values.most);
}

std::string limit_text(double limit) {
    return limit == 1e15 ? "10^15" : format("%.9g", limit);
}

Status out_of_range(const std::string& what, const Key& key, double value) {
    const std::string range = range_text(key);
    return invalid("%s: '%s' is %.15g, expected %s", what.c_str(), key.name, value,
                   range.empty() ? "a finite number" : range.c_str());
}

ConfigEntry one(ConfigScalar value) {
    return {"", {std::move(value)}, false, false};
}

template <class T>
Status read_integer(const Config& config, const Key& key, T& field) {
    SPLAT_ASSIGN(const std::int64_t value,
                 config.get<std::int64_t>(key.name, static_cast<std::int64_t>(field)));
    SPLAT_TRY(check_range(config.what(), key, static_cast<double>(value)));
    field = static_cast<T>(value);
    return {};
}

template <class T>
Status read_number(const Config& config, const Key& key, T& field) {
    SPLAT_ASSIGN(const double value, config.get<double>(key.name, static_cast<double>(field)));
    SPLAT_TRY(check_range(config.what(), key, value));
    const auto narrowed = static_cast<T>(value);
    if (!std::isfinite(narrowed) || (narrowed == 0 && value != 0))
        return invalid(
            "%s: '%s' is %.15g, expected a number that float32 holds: 0, or 1.4e-45 to "
            "3.4e38 in size",
            config.what().c_str(), key.name, value);
    field = narrowed;
    return {};
}

}  // namespace

Status check_range(const std::string& what, const Key& key, double value) {
    return in_range(key.values, value) ? Status() : out_of_range(what, key, value);
}

Status read_field(const Config& config, const Key& key, std::uint32_t& field) {
    return read_integer(config, key, field);
}

Status read_field(const Config& config, const Key& key, std::uint64_t& field) {
    return read_integer(config, key, field);
}

Status read_field(const Config& config, const Key& key, float& field) {
    return read_number(config, key, field);
}

Status read_field(const Config& config, const Key& key, double& field) {
    return read_number(config, key, field);
}

Status read_field(const Config& config, const Key& key, bool& field) {
    SPLAT_ASSIGN(field, config.get<bool>(key.name, field));
    return {};
}

Status read_field(const Config& config, const Key& key, std::string& field) {
    SPLAT_ASSIGN(field, config.get<std::string>(key.name, field));
    return {};
}

Status read_field(const Config& config, const Key& key, std::vector<std::uint32_t>& field) {
    SPLAT_ASSIGN(const std::vector<std::int64_t> values,
                 config.get_list<std::int64_t>(key.name, {field.begin(), field.end()}));
    field.clear();
    for (const std::int64_t value : values) {
        SPLAT_TRY(check_range(config.what(), key, static_cast<double>(value)));
        field.push_back(static_cast<std::uint32_t>(value));
    }
    return {};
}

Status read_field(const Config& config, const Key& key, std::vector<std::string>& field) {
    SPLAT_ASSIGN(field, config.get_list<std::string>(key.name, field));
    return {};
}

Status read_field(const Config& config, const Key& key, std::array<double, 2>& field) {
    SPLAT_ASSIGN(const std::vector<double> values,
                 config.get_list<double>(key.name, {field.begin(), field.end()}));
    if (values.size() != field.size())
        return invalid("%s: '%s' has %zu numbers, expected %zu", config.what().c_str(), key.name,
                       values.size(), field.size());
    for (const double value : values) SPLAT_TRY(check_range(config.what(), key, value));
    std::copy(values.begin(), values.end(), field.begin());
    return {};
}

Status read_word(const Config& config, const Key& key, int& place) {
    const std::vector<std::string> words = words_of(key);
    SPLAT_ASSIGN(const std::string word,
                 config.get<std::string>(key.name, words[static_cast<std::size_t>(place)]));
    const auto found = std::find(words.begin(), words.end(), word);
    if (found == words.end())
        return invalid("%s: '%s' is '%s', expected one of %s", config.what().c_str(), key.name,
                       shown(word).c_str(), key.values.words);
    place = static_cast<int>(found - words.begin());
    return {};
}

ConfigEntry write_field(const Key& /*key*/, float value) {
    constexpr float kMostWhole = 1e9F;
    if (std::abs(value) < kMostWhole && std::trunc(value) == value)
        return one(static_cast<std::int64_t>(value));
    char text[32];
    const std::to_chars_result end = std::to_chars(text, text + sizeof text, value);
    return one(*decimal_number({text, end.ptr}));
}

ConfigEntry write_word(const Key& key, int place) {
    return one(words_of(key)[static_cast<std::size_t>(place)]);
}

bool same_value(const ConfigEntry& a, const ConfigEntry& b) {
    const auto number = [](const ConfigEntry& entry) {
        const ConfigScalar& value = entry.values[0];
        if (const auto* whole = std::get_if<std::int64_t>(&value))
            return static_cast<double>(*whole);
        const auto* real = std::get_if<double>(&value);
        return real != nullptr ? *real : std::numeric_limits<double>::quiet_NaN();
    };
    if (config_value_text(a) == config_value_text(b)) return true;
    if (a.list || b.list || a.map || b.map) return false;
    return std::abs(number(a) - number(b)) <= 1e-6 * std::abs(number(b));
}

std::vector<std::string> words_of(const Key& key) {
    std::vector<std::string> words;
    for (std::string_view rest = key.values.words; !rest.empty();) {
        const std::size_t end = std::min(rest.find(", "), rest.size());
        words.emplace_back(rest.substr(0, end));
        rest.remove_prefix(std::min(end + 2, rest.size()));
    }
    return words;
}

std::string range_text(const Key& key) {
    const Values& v = key.values;
    if (*v.words != '\0') return v.words;
    const bool from = std::isfinite(v.least);
    const bool to = std::isfinite(v.most);
    if (!from && !to) return "";
    if (!to) return (v.above ? "more than " : "at least ") + limit_text(v.least);
    return limit_text(v.least) + (v.below ? " to below " : " to ") + limit_text(v.most);
}

}  // namespace splat::config

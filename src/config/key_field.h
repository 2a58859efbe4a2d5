#pragma once

#include <array>
#include <type_traits>

#include "config/config_keys.h"

namespace splat::config {

/// Errors: kInvalidArgument for a value beyond the range of the key, `what` naming the configuration.
Status check_range(const std::string& what, const Key& key, double value);

/// The value of a key; the field is unchanged if the key is missing or null.
/// Errors: kInvalidArgument, naming file and key, for a value of another kind or beyond the range.
Status read_field(const Config& config, const Key& key, std::uint32_t& field);
Status read_field(const Config& config, const Key& key, std::uint64_t& field);
Status read_field(const Config& config, const Key& key, float& field);
Status read_field(const Config& config, const Key& key, double& field);
Status read_field(const Config& config, const Key& key, bool& field);
Status read_field(const Config& config, const Key& key, std::string& field);
Status read_field(const Config& config, const Key& key, std::vector<std::uint32_t>& field);
Status read_field(const Config& config, const Key& key, std::vector<std::string>& field);

/// Two numbers. Errors: also for a list of another length.
Status read_field(const Config& config, const Key& key, std::array<double, 2>& field);

/// The place of a word among those of a choice.
Status read_word(const Config& config, const Key& key, int& place);

/// Writes the fewest digits that restore the float: 0.8, not 0.800000012. A whole number is written as an integer: as
/// a double it would be "1e+08".
ConfigEntry write_field(const Key& key, float value);

/// Integers of any size as one of 64 bits, lists element by element, and all else as it is.
template <class T>
ConfigEntry write_field(const Key& /*key*/, const T& value) {
    const auto scalar = [](const auto& element) -> ConfigScalar {
        using Element = std::decay_t<decltype(element)>;
        if constexpr (std::is_integral_v<Element> && !std::is_same_v<Element, bool>)
            return static_cast<std::int64_t>(element);
        else
            return element;
    };
    if constexpr (std::is_arithmetic_v<T> || std::is_same_v<T, std::string>) {
        return {"", {scalar(value)}, false, false};
    } else {
        ConfigEntry entry{"", {}, true, false};
        for (const auto& element : value) entry.values.push_back(scalar(element));
        return entry;
    }
}

ConfigEntry write_word(const Key& key, int place);

/// True if two values are the same; numbers of a file have more digits than the field that holds them.
bool same_value(const ConfigEntry& a, const ConfigEntry& b);

/// The words of a choice.
std::vector<std::string> words_of(const Key& key);

template <class T>
constexpr KeyType type_of() {
    if (std::is_enum_v<T>) return KeyType::kChoice;
    if (std::is_same_v<T, bool>) return KeyType::kBoolean;
    if (std::is_same_v<T, std::string>) return KeyType::kText;
    if (std::is_same_v<T, std::vector<std::uint32_t>>) return KeyType::kIntegers;
    if (std::is_same_v<T, std::array<double, 2>>) return KeyType::kNumbers;
    if (std::is_same_v<T, std::vector<std::string>>) return KeyType::kTexts;
    return std::is_floating_point_v<T> ? KeyType::kNumber : KeyType::kInteger;
}

template <class Struct, class T>
Struct struct_of(T Struct::*);

/// The member that a chain of pointers to members leads to, from the network's part or the training's.
template <auto First, auto... Rest>
auto& member_of(auto& settings) {
    if constexpr (std::is_same_v<decltype(struct_of(First)), ModelConfig>)
        return ((settings.network.*First).*....*Rest);
    else
        return ((settings.training.*First).*....*Rest);
}

/// A key whose value is one member: field<&ModelConfig::lora, &LoraConfig::alpha>().
template <auto... Members>
constexpr Field field(Part part) {
    using T = std::remove_reference_t<decltype(member_of<Members...>(std::declval<Settings&>()))>;
    Field made{type_of<T>(), part};
    if constexpr (std::is_enum_v<T>) {
        made.read = [](const Config& config, const Key& key, Settings& settings) {
            int place = static_cast<int>(member_of<Members...>(settings));
            Status status = read_word(config, key, place);
            member_of<Members...>(settings) = static_cast<T>(place);
            return status;
        };
        made.write = [](const Key& key, const Settings& settings) {
            return write_word(key, static_cast<int>(member_of<Members...>(settings)));
        };
    } else {
        made.read = [](const Config& config, const Key& key, Settings& settings) {
            return read_field(config, key, member_of<Members...>(settings));
        };
        made.write = [](const Key& key, const Settings& settings) {
            return write_field(key, member_of<Members...>(settings));
        };
    }
    return made;
}

}  // namespace splat::config

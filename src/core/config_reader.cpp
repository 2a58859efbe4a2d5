#include "core/config_reader.h"

#include <algorithm>
#include <cmath>

namespace splat {

bool ConfigReader::take(Status status) {
    if (status_.ok()) status_ = std::move(status);
    return status_.ok();
}

void ConfigReader::fail(const char* key, double value, const char* expected) {
    take(error(Code::kInvalidArgument, "%s: '%s' is %g, expected %s", config_.what().c_str(), key,
               value, expected));
}

template <class T>
bool ConfigReader::get(const char* key, T& value) {
    auto found = config_.get<T>(key, value);
    if (!take(found.status())) return false;
    value = std::move(found.value());
    return true;
}

void ConfigReader::count(const char* key, std::uint32_t& field) {
    std::int64_t value = field;
    if (!get(key, value)) return;
    if (value < 0 || value > 1'000'000) {
        fail(key, static_cast<double>(value), "0 to 1000000");
        return;
    }
    field = static_cast<std::uint32_t>(value);
}

void ConfigReader::count(const char* key, std::uint64_t& field) {
    auto value = static_cast<std::int64_t>(field);
    if (!get(key, value)) return;
    if (value < 0 || value > 1'000'000'000'000'000) {
        fail(key, static_cast<double>(value), "0 to 10^15");
        return;
    }
    field = static_cast<std::uint64_t>(value);
}

void ConfigReader::whole(const char* key, std::int64_t& field) {
    get(key, field);
}

void ConfigReader::number(const char* key, double& field) {
    double value = field;
    if (!get(key, value)) return;
    if (!std::isfinite(value)) fail(key, value, "a finite number");
    field = value;
}

void ConfigReader::number(const char* key, float& field) {
    auto value = static_cast<double>(field);
    number(key, value);
    field = static_cast<float>(value);
}

void ConfigReader::number(const char* key, double& field, double least, double most) {
    number(key, field);
    if (status_.ok() && !(field >= least && field <= most))
        fail(key, field, format("%g to %g", least, most).c_str());
}

void ConfigReader::flag(const char* key, bool& field) {
    get(key, field);
}

void ConfigReader::text(const char* key, std::string& field) {
    get(key, field);
}

std::string ConfigReader::choice(const char* key, const char* otherwise,
                                 const std::vector<std::string>& allowed) {
    std::string value = otherwise;
    if (!get(key, value)) return otherwise;
    if (std::find(allowed.begin(), allowed.end(), value) == allowed.end()) {
        std::string list;
        for (const std::string& name : allowed) list += (list.empty() ? "" : ", ") + name;
        take(error(Code::kInvalidArgument, "%s: '%s' is '%s', expected one of %s",
                   config_.what().c_str(), key, value.c_str(), list.c_str()));
    }
    return value;
}

void ConfigReader::counts(const char* key, std::vector<std::uint32_t>& field) {
    const auto values =
        config_.get_list<std::int64_t>(key, std::vector<std::int64_t>(field.begin(), field.end()));
    if (!take(values.status())) return;
    field.clear();
    for (const std::int64_t value : values.value()) {
        if (value < 1 || value > 1'000'000) fail(key, static_cast<double>(value), "at least 1");
        field.push_back(static_cast<std::uint32_t>(value));
    }
}

void ConfigReader::numbers(const char* key, std::vector<double>& field) {
    const auto values = config_.get_list<double>(key, field);
    if (take(values.status())) field = values.value();
}

void ConfigReader::texts(const char* key, std::vector<std::string>& field) {
    const auto values = config_.get_list<std::string>(key, field);
    if (take(values.status())) field = values.value();
}

}  // namespace splat

#include "api/train/settings.h"

#include "api/api_guard.h"
#include "config/config_file.h"
#include "core/log.h"

namespace splat::api {

Result<config::Settings> settings_of(const char* text, std::span<const std::string> changes) {
    Config config("configuration");
    if (text != nullptr) SPLAT_SET(config, read_config(text, "configuration"));
    SPLAT_ASSIGN(config, config::with_values(config, changes));
    return config::settings_of(config);
}

Result<config::Settings> training_settings_of(const char* text, config::VectorsFrom vectors) {
    Config config("configuration");
    if (text != nullptr) SPLAT_SET(config, read_config(text, "configuration"));
    SPLAT_ASSIGN(const auto warnings, config::training_warnings(config, vectors));
    for (const std::string& warning : warnings) log(LogLevel::kWarning, warning);
    SPLAT_ASSIGN(config::Settings settings, config::settings_of(config));
    const auto refuse = [](const char* key, const std::string& value, const char* expected) {
        return invalid(
            "'%s' is %s, expected %s where the caller makes the steps; splat_training_open takes "
            "it",
            key, value.c_str(), expected);
    };
    const config::TrainConfig& c = settings.training;
    if (!c.stages.empty())
        return refuse("opt.stages", format("a list of %zu", c.stages.size()), "none");
    if (c.target_resolution != 0)
        return refuse("opt.target_resolution", std::to_string(c.target_resolution), "0");
    return settings;
}

Result<std::vector<std::string>> texts_of(const char* const* values, std::size_t count) {
    if (count > 0) SPLAT_TRY(require(values, "values"));
    std::vector<std::string> texts;
    for (std::size_t i = 0; i < count; ++i) {
        SPLAT_TRY(require(values[i], format("values[%zu]", i).c_str()));
        texts.emplace_back(values[i]);
    }
    return texts;
}

}  // namespace splat::api

#include "api/api_guard.h"
#include "api/train/settings.h"
#include "config/config_file.h"
#include "config/effects.h"
#include "config/presets.h"
#include "core/json_writer.h"

using namespace splat;

splat_result splat_config_check(const char* text, const char* const* values, size_t count,
                                char* buffer, size_t capacity, size_t* needed) {
    return api::guarded_text(buffer, capacity, needed, [&]() -> Result<std::string> {
        SPLAT_ASSIGN(const auto texts, api::texts_of(values, count));
        Config config("configuration");
        if (text != nullptr) SPLAT_SET(config, read_config(text, "configuration"));
        SPLAT_ASSIGN(config, config::with_values(config, texts));
        SPLAT_ASSIGN(const auto warnings, config::training_warnings(config));
        JsonWriter json;
        json.begin_object().key("warnings").begin_array();
        for (const std::string& warning : warnings) json.value(warning);
        return json.end().end().text();
    });
}

splat_result splat_config_presets(char* buffer, size_t capacity, size_t* needed) {
    return api::guarded_text(buffer, capacity, needed, [] { return config::presets_json(); });
}

splat_result splat_config_preset(const char* name, char* buffer, size_t capacity, size_t* needed) {
    return api::guarded_text(buffer, capacity, needed, [&]() -> Result<std::string> {
        SPLAT_TRY(api::require(name, "name"));
        SPLAT_ASSIGN(const config::Preset preset, config::preset_of(name));
        return std::string(preset.text);
    });
}

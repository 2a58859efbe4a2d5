#include "config/presets.h"

#include "core/json_writer.h"

namespace splat::config {

Result<Preset> preset_of(std::string_view name) {
    std::string names;
    for (const Preset& preset : presets()) {
        if (preset.name == name) return preset;
        names += (names.empty() ? "" : ", ") + std::string(preset.name);
    }
    return invalid("there is no configuration '%s'; there are: %s", std::string(name).c_str(),
                   names.c_str());
}

std::string presets_json() {
    JsonWriter json;
    json.begin_array();
    for (const Preset& preset : presets()) {
        const std::string_view line = preset.text.substr(0, preset.text.find('\n'));
        json.newline()
            .begin_object()
            .member("name", std::string(preset.name))
            .member("about", std::string(line.substr(2)))
            .end();
    }
    return json.end().text();
}

}  // namespace splat::config

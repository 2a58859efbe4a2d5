#include "prior_models/preset.h"

#include <filesystem>

#include "core/config.h"
#include "core/environment.h"
#include "core/os/path.h"
#include "core/shown.h"
#include "prior_models/embedded_presets.h"
#include "prior_models/preset_reader.h"

namespace splat::prior_models {
namespace {

namespace fs = std::filesystem;

bool is_json(const std::string& text) {
    const std::size_t first = text.find_first_not_of(" \t\r\n");
    return first != std::string::npos && text[first] == '{';
}

}  // namespace

std::uint32_t Preset::maps() const {
    std::uint32_t flags = 0;
    for (const PresetOutput& output : outputs) flags |= data::flag_of(output.map);
    return flags;
}

const PresetOutput* Preset::find(data::MapKind map) const {
    for (const PresetOutput& output : outputs)
        if (output.map == map) return &output;
    return nullptr;
}

Result<Preset> parse_preset(const std::string& text) {
    SPLAT_ASSIGN(const JsonTree tree, parse_json_tree(text, "preset"));
    return read_preset(tree);
}

std::vector<std::string> preset_names() {
    std::vector<std::string> names;
    for (const EmbeddedPreset& preset : embedded_presets()) names.emplace_back(preset.name);
    return names;
}

Result<std::string> preset_text(const std::string& name) {
    if (is_json(name)) return name;
    for (const EmbeddedPreset& preset : embedded_presets())
        if (name == preset.name) return std::string(preset.text);
    const std::vector<std::string> names = preset_names();
    const std::string nearest = nearest_name(name, names);
    return not_found(
        "there is no preset '%s'%s", name.c_str(),
        nearest.empty() ? (", expected " + joined(names) + ", or JSON that starts with '{'").c_str()
                        : ("; did you mean '" + nearest + "'?").c_str());
}

Result<Preset> preset_of(const std::string& text) {
    SPLAT_ASSIGN(const std::string json, preset_text(text));
    return parse_preset(json);
}

Result<Preset> preset_of_file(const std::string& path) {
    const fs::path file = os::path_of(path).filename();
    for (const bool whole : {true, false})
        for (const EmbeddedPreset& embedded : embedded_presets()) {
            SPLAT_ASSIGN(Preset preset, parse_preset(embedded.text));
            const fs::path own = os::path_of(preset.file.name);
            if (whole ? own == file : own.stem() == file.stem()) return preset;
        }
    return not_found("no preset has a file '%s': name the model's preset, expected %s, or JSON",
                     os::text_of(file).c_str(), joined(preset_names()).c_str());
}

std::string models_folder() {
    if (const auto folder = environment("SPLAT_PRIORS_DIR")) return *folder;
#if defined(_WIN32)
    if (const auto data = environment_folder("LOCALAPPDATA")) return *data + "/libsplat/priors";
#else
    if (const auto data = environment_folder("XDG_DATA_HOME")) return *data + "/libsplat/priors";
    if (const auto home = environment("HOME")) return *home + "/.local/share/libsplat/priors";
#endif
    return "";
}

std::string preset_path(const Preset& preset) {
    const std::string own = models_folder() + "/" + preset.file.name;
    fs::path path = os::path_of(own);
    std::error_code none;
    if (preset.file.name.empty() || path.extension() == ".onnx" || fs::is_regular_file(path, none))
        return own;
    for (const char* extension : {".safetensors", ".pt", ".onnx"})
        if (fs::is_regular_file(path.replace_extension(extension), none)) return os::text_of(path);
    return own;
}

}  // namespace splat::prior_models

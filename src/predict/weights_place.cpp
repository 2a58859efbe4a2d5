#include "predict/weights_place.h"

#include <cmath>
#include <filesystem>
#include <numbers>
#include <set>

#include "config/config_file.h"
#include "core/c_locale.h"
#include "core/environment.h"
#include "core/os/path.h"
#include "core/path_name.h"
#include "core/shown.h"

namespace splat::predict {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFile = "weights.safetensors";

/// Folders of built-in weights, best first: below the prefix of an installed library, which is one or two
/// folders above it (lib/x86_64-linux-gnu); below a build folder, or below its sources.
std::vector<fs::path> weights_folders(const fs::path& library) {
    const fs::path installed = os::path_of(SPLAT_DATADIR) / "libsplat" / "weights";
    std::vector<fs::path> folders = {library.parent_path() / installed,
                                     library.parent_path().parent_path() / installed};
    for (fs::path folder = library; folder.has_relative_path(); folder = folder.parent_path())
        folders.push_back(folder / "tools" / "weights");
    return folders;
}

bool is_file(const fs::path& path) {
    std::error_code none;
    return fs::is_regular_file(path, none);
}

std::string names_in(const std::vector<fs::path>& folders) {
    std::set<std::string> names;
    std::error_code none;
    for (const fs::path& folder : folders)
        for (fs::directory_iterator entry(folder, none), end; !none && entry != end;
             entry.increment(none))
            if (is_file(entry->path() / kFile)) names.insert(os::text_of(entry->path().filename()));
    return joined(names);
}

}  // namespace

Result<std::string> builtin_weights_near(const std::string& library, const std::string& name) {
    const std::vector<fs::path> folders = weights_folders(os::path_of(library));
    const bool plain = is_name_in_folder(name) && name[0] != '.';
    for (const fs::path& folder : folders)
        if (plain && is_file(folder / name / kFile))
            return os::text_of((folder / name / kFile).lexically_normal());
    const std::string names = names_in(folders);
    return not_found(
        "no built-in weights '%s' near the library in '%s', %s", name.c_str(), library.c_str(),
        names.empty() ? "and no others: name a file of weights" : ("expected " + names).c_str());
}

Result<std::string> builtin_weights(const std::string& name) {
    return builtin_weights_near(library_folder(), name);
}

Result<std::string> weights_named(const std::string& given) {
    const fs::path path = os::path_of(given);
    const bool name = !given.empty() && !path.has_parent_path() && !path.has_extension();
    std::error_code none;
    if (!name || fs::exists(path, none)) return given;
    const Result<std::string> found = builtin_weights(given);
    if (found.ok()) return found;
    return error(found.status().code(), "there is no file '%s', and %s", given.c_str(),
                 found.status().message().c_str());
}

Result<std::string> config_beside(const std::string& weights, const std::string& adapters) {
    if (const fs::path own = os::path_of(adapters).replace_extension(".json");
        !adapters.empty() && is_file(own))
        return os::text_of(own);
    const fs::path file = os::path_of(weights);
    const std::string stem = os::text_of(file.stem());
    for (const std::string& name :
         {stem + ".json", stem + ".yaml", std::string("config.json"), std::string("config.yaml")})
        if (is_file(file.parent_path() / name)) return os::text_of(file.parent_path() / name);
    return not_found("no config.json or config.yaml in the folder of '%s': give the configuration",
                     weights.c_str());
}

Result<config::Settings> settings_of(const std::string& text, const std::string& what) {
    SPLAT_ASSIGN(const Config config, read_config(text, what));
    return config::settings_of(config);
}

Result<double> adapters_alpha(const io::WeightsFile& adapters, const config::ModelConfig& network) {
    for (const auto& [key, value] : adapters.metadata) {
        if (key != "lora_alpha") continue;
        const auto alpha = decimal_number(value);
        if (alpha && std::isfinite(*alpha)) return *alpha;
        return damaged("the adapters' metadata has lora_alpha '%s', expected a number",
                       value.c_str());
    }
    if (network.lora.rank > 0) return static_cast<double>(network.lora.alpha);
    return invalid("neither the adapters' metadata nor the configuration says lora_alpha: give it");
}

std::optional<double> field_of_view(const io::NamedTensors& tensors) {
    const io::NamedTensor* const rays = tensors.find("ray_dirs");
    if (rays == nullptr || rays->dims.size() != 4 || rays->dims[3] < 2 || rays->values.empty())
        return std::nullopt;
    const auto columns = static_cast<std::size_t>(rays->dims[3]);
    const auto side = static_cast<double>(columns);
    const double last = std::abs(static_cast<double>(rays->values[columns - 1]));
    const double degrees = 2 * std::atan(side / (side - 1) * last) * 180 / std::numbers::pi;
    return std::isfinite(degrees) ? std::optional(degrees) : std::nullopt;
}

}  // namespace splat::predict

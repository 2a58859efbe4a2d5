#include "core/environment.h"

#include <dlfcn.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "core/c_locale.h"

namespace splat {

std::optional<std::string> environment(const char* name) {
    const char* value = std::getenv(name);
    if (value == nullptr || *value == '\0') return std::nullopt;
    return std::string(value);
}

Result<double> environment_positive(const char* name, double fallback) {
    const auto text = environment(name);
    if (!text) return fallback;
    const auto value = decimal_number(*text);
    if (!value || !std::isfinite(*value) || *value <= 0)
        return invalid("environment variable %s is '%s', expected a number > 0", name,
                       text->c_str());
    return *value;
}

std::optional<std::string> environment_folder(const char* name) {
    auto folder = environment(name);
    return folder && folder->starts_with('/') ? folder : std::nullopt;
}

std::optional<std::string> user_cache_folder() {
    if (const auto cache = environment_folder("XDG_CACHE_HOME")) return *cache + "/libsplat";
    if (const auto home = environment("HOME")) return *home + "/.cache/libsplat";
    return std::nullopt;
}

std::string library_folder() {
    Dl_info info{};
    if (dladdr(reinterpret_cast<const void*>(&library_folder), &info) == 0 ||
        info.dli_fname == nullptr)
        return "";
    std::error_code none;
    return std::filesystem::canonical(info.dli_fname, none).parent_path().string();
}

}  // namespace splat

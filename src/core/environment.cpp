#include "core/environment.h"

#include <cmath>
#include <filesystem>

#include "core/c_locale.h"
#include "core/os/library.h"
#include "core/os/path.h"

namespace splat {

std::optional<std::string> environment(const char* name) {
    auto value = os::variable(name);
    return value && !value->empty() ? value : std::nullopt;
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
    return folder && os::is_absolute(*folder) ? folder : std::nullopt;
}

std::optional<std::string> user_cache_folder() {
    const auto folder = os::cache_folder();
    return folder ? std::optional(*folder + "/libsplat") : std::nullopt;
}

std::string library_folder() {
    const std::string file = os::file_of_code();
    std::error_code none;
    return file.empty()
               ? ""
               : os::text_of(std::filesystem::canonical(os::path_of(file), none).parent_path());
}

}  // namespace splat

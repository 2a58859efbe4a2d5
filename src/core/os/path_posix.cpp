#include "core/os/path.h"

#include <cstdlib>

namespace splat::os {

std::filesystem::path path_of(const std::string& text) {
    return text;
}

std::string text_of(const std::filesystem::path& path) {
    return path.native();
}

bool may_create(const std::string&) {
    return true;
}

std::size_t name_start(const std::string& path) {
    return path.rfind('/') + 1;  // 0 without a folder
}

bool is_absolute(const std::string& path) {
    return path.starts_with('/');
}

std::optional<std::string> variable(const char* name) {
    const char* const value = std::getenv(name);
    return value == nullptr ? std::nullopt : std::optional<std::string>(value);
}

std::string temporary_place() {
    const std::string named = variable("TMPDIR").value_or("");
    return named.empty() ? "/tmp" : named;
}

std::optional<std::string> cache_folder() {
    // The specification asks to ignore relative ones.
    if (const auto cache = variable("XDG_CACHE_HOME"); cache && is_absolute(*cache)) return cache;
    if (const auto home = variable("HOME"); home && !home->empty()) return *home + "/.cache";
    return std::nullopt;
}

}  // namespace splat::os

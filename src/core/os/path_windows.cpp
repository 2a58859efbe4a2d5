#include "core/os/path.h"

#include <algorithm>
#include <cctype>
#include <cerrno>

#include "core/os/windows.h"

namespace splat::os {
namespace {

bool has_drive(const std::string& path) {
    return path.size() >= 2 && path[1] == ':' &&
           std::isalpha(static_cast<unsigned char>(path[0])) != 0;
}

bool is_separator(char c) {
    return c == '/' || c == '\\';
}

}  // namespace

std::filesystem::path path_of(const std::string& text) {
    return wide(text);
}

std::string text_of(const std::filesystem::path& path) {
    return utf8(path.generic_wstring());
}

bool may_create(const std::string& path) {
    std::size_t at = path.starts_with(R"(\\?\)") ? 4 : 0;
    if (has_drive(path.substr(at))) at += 2;
    while (at < path.size()) {
        const std::size_t end = std::min(path.find_first_of("/\\", at), path.size());
        const std::string part = path.substr(at, end - at);
        at = end + 1;
        if (part == "." || part == ".." || !is_reserved_name(part)) continue;
        errno = EINVAL;
        return false;
    }
    return true;
}

std::size_t name_start(const std::string& path) {
    const std::size_t start = path.find_last_of("/\\") + 1;  // 0 without a folder
    return start == 0 && has_drive(path) ? 2 : start;
}

bool is_absolute(const std::string& path) {
    if (has_drive(path)) return path.size() > 2 && is_separator(path[2]);
    return path.size() > 1 && is_separator(path[0]) && is_separator(path[1]);
}

std::optional<std::string> variable(const char* name) {
    const std::wstring wide_name = wide(name);
    const DWORD units = ::GetEnvironmentVariableW(wide_name.c_str(), nullptr, 0);
    if (units == 0) return std::nullopt;
    std::wstring value(units, L'\0');
    value.resize(::GetEnvironmentVariableW(wide_name.c_str(), value.data(), units));
    return utf8(value);
}

std::string temporary_place() {
    std::wstring place(MAX_PATH + 1, L'\0');
    place.resize(::GetTempPathW(MAX_PATH + 1, place.data()));
    return text_of(place);
}

std::optional<std::string> cache_folder() {
    auto folder = variable("LOCALAPPDATA");
    return folder && is_absolute(*folder) ? folder : std::nullopt;
}

}  // namespace splat::os

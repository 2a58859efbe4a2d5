#include "core/os/path.h"

#include <atomic>

#include "core/os/process.h"

namespace splat::os {

std::filesystem::path path_of(const std::string& text) {
    return {reinterpret_cast<const char8_t*>(text.data()),
            reinterpret_cast<const char8_t*>(text.data()) + text.size()};
}

std::string text_of(const std::filesystem::path& path) {
    const std::u8string text = path.generic_u8string();
    return {text.begin(), text.end()};
}

std::string folder_of(const std::string& path) {
    const std::size_t start = name_start(path);
    if (start == 0) return ".";
    // Without their last character "/", "C:/" and "C:" would be other folders.
    const bool root = start == 1 || path[start - 1] == ':' || path[start - 2] == ':';
    return path.substr(0, root ? start : start - 1);
}

std::string temporary_name(const std::string& target) {
    static std::atomic<unsigned> counter{0};
    const std::string suffix =
        "." + std::to_string(process_id()) + "-" + std::to_string(counter++) + ".tmp";
    return target.substr(0, name_start(target) + kLongestName - suffix.size()) + suffix;
}

}  // namespace splat::os

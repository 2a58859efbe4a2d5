#include "core/os/path.h"

#include <algorithm>
#include <atomic>

#include "core/os/process.h"

namespace splat::os {

namespace {

/// conin$ and conout$ are the console's; com and lpt have a digit behind them, also a superscript one.
constexpr std::string_view kDevices[] = {"con", "prn", "aux", "nul", "conin$", "conout$"};
constexpr std::string_view kPorts[] = {"com", "lpt"};
constexpr std::string_view kDigits[] = {"1", "2", "3", "4",        "5",        "6",
                                        "7", "8", "9", "\xC2\xB9", "\xC2\xB2", "\xC2\xB3"};

#if defined(_WIN32)
constexpr bool kHasDrives = true;
#else
constexpr bool kHasDrives = false;
#endif

/// ASCII alone.
std::string lower(std::string text) {
    for (char& c : text)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return text;
}

}  // namespace

bool is_device_name(std::string_view name) {
    std::string start = lower(std::string(name.substr(0, name.find_first_of(".:"))));
    start.erase(start.find_last_not_of(' ') + 1);
    if (std::ranges::find(kDevices, start) != std::end(kDevices)) return true;
    const std::string_view port = std::string_view(start).substr(0, 3);
    return std::ranges::find(kPorts, port) != std::end(kPorts) &&
           std::ranges::find(kDigits, std::string_view(start).substr(port.size())) !=
               std::end(kDigits);
}

bool is_reserved_name(std::string_view name) {
    const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20; };
    return is_device_name(name) || std::ranges::any_of(name, is_control) ||
           name.find_first_of("<>:\"/\\|?*") != name.npos || name.ends_with('.') ||
           name.ends_with(' ');
}

std::string one_name(const std::string& name) {
#if defined(_WIN32) || defined(__APPLE__)
    return lower(name);
#else
    return name;
#endif
}

std::string folder_of(const std::string& path) {
    const std::size_t start = name_start(path);
    if (start == 0) return ".";
    // Without their last character "/", "C:/" and "C:" would be other folders.
    const bool root =
        start == 1 || (kHasDrives && (path[start - 1] == ':' || path[start - 2] == ':'));
    return path.substr(0, root ? start : start - 1);
}

std::vector<std::string> listed_paths(const std::string& text) {
    std::vector<std::string> paths;
    for (std::size_t start = 0; start < text.size();) {
        const std::size_t end = std::min(text.find(kListSeparator, start), text.size());
        if (end > start) paths.push_back(text.substr(start, end - start));
        start = end + 1;
    }
    return paths;
}

std::string temporary_name(const std::string& target) {
    static std::atomic<unsigned> counter{0};
    const std::string suffix =
        "." + std::to_string(process_id()) + "-" + std::to_string(counter++) + ".tmp";
    return target.substr(0, name_start(target) + kLongestName - suffix.size()) + suffix;
}

}  // namespace splat::os

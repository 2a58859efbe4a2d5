#include "core/os/graphics.h"

#include <unistd.h>

#include <algorithm>

#include "core/os/file.h"
#include "core/os/path.h"

namespace splat::os {
namespace {

/// The value of a variable that is not empty.
std::string value_of(const char* name, const std::string& otherwise) {
    const std::string value = variable(name).value_or("");
    return value.empty() ? otherwise : value;
}

std::vector<std::string> names_in(const std::string& folder) {
    std::vector<Listed> all;
    std::vector<std::string> names;
    static_cast<void>(list(folder, all));  // what is not there has none
    for (Listed& one : all) names.push_back(std::move(one.name));
    std::sort(names.begin(), names.end());
    return names;
}

}  // namespace

std::string vulkan_loader() {
#if defined(__APPLE__)
    return "libvulkan.1.dylib";
#else
    return "libvulkan.so.1";
#endif
}

std::vector<std::string> vulkan_drivers() {
    const std::string home = value_of("HOME", "");
    std::vector<std::string> roots = {value_of("XDG_CONFIG_HOME", home + "/.config")};
    const auto add = [&](const std::vector<std::string>& more) {
        roots.insert(roots.end(), more.begin(), more.end());
    };
    add(listed_paths(value_of("XDG_CONFIG_DIRS", "/etc/xdg")));
    add({"/etc", value_of("XDG_DATA_HOME", home + "/.local/share")});
    add(listed_paths(value_of("XDG_DATA_DIRS", "/usr/local/share:/usr/share")));
    std::vector<std::string> files;
    for (const std::string& root : roots) {
        const std::string folder = root + "/vulkan/icd.d";
        for (const std::string& name : names_in(folder))
            if (name.ends_with(".json")) files.push_back((folder + "/").append(name));
    }
    return files;
}

std::vector<Gpu> gpus() {
    std::vector<Gpu> all;
    for (const std::string& name : names_in("/dev/dri"))
        if (name.starts_with("renderD")) {
            const std::string node = "/dev/dri/" + name;
            all.push_back({node, ::access(node.c_str(), R_OK | W_OK) == 0});
        }
    FileInfo info;
    if (all.empty() && examine("/dev/nvidiactl", info) == 0) all.push_back({"/dev/nvidiactl"});
    return all;
}

}  // namespace splat::os

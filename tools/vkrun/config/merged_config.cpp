#include "vkrun/config/merged_config.h"

#include <filesystem>

#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"

namespace vkrun {

Json merged_config(const std::string& path, const std::vector<std::string>& changes) {
    const std::string text = path.empty() ? "" : read_text(path);
    std::vector<const char*> values;
    for (const std::string& change : changes) values.push_back(change.c_str());
    std::size_t needed = 0;
    const char* const from = path.empty() ? nullptr : text.c_str();
    const splat_result result =
        splat_config_merge(from, values.data(), values.size(), nullptr, 0, &needed);
    if (result != SPLAT_INCOMPLETE)
        throw Failure(kUsageError, (path.empty() ? "" : path + ": ") + splat_last_error_message());
    std::string merged(needed, '\0');
    check(splat_config_merge(from, values.data(), values.size(), merged.data(), needed, nullptr));
    return Json::parse(merged.c_str());
}

std::string config_beside(const std::string& weights, const std::string& given) {
    if (!given.empty()) return given;
    const std::filesystem::path folder = std::filesystem::path(weights).parent_path();
    for (const char* name : {"config.json", "config.yaml"})
        if (std::filesystem::exists(folder / name)) return (folder / name).string();
    throw Failure(kUsageError, "no config.json or config.yaml in the folder of '" + weights +
                                   "': name the configuration with --config");
}

}  // namespace vkrun

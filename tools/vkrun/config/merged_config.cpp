#include "vkrun/config/merged_config.h"

#include <filesystem>

#include "core/os/path.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/text.h"

namespace vkrun {
namespace {

/// A file's text; the library's functions take text up to a NUL.
std::string text_of(const std::string& path) {
    std::string text = read_text(path);
    if (const std::size_t nul = text.find('\0'); nul != std::string::npos)
        throw Failure(kUsageError,
                      path + format(": a NUL at byte %zu of %zu, expected text; is the file "
                                    "damaged, or of another format?",
                                    nul, text.size()));
    return text;
}

}  // namespace

std::string config_text(const std::string& path) {
    std::error_code ignored;
    std::size_t needed = 0;
    const bool is_name = path.find_first_of("/.") == std::string::npos;
    if (!is_name || std::filesystem::is_regular_file(splat::os::path_of(path), ignored))
        return text_of(path);
    if (splat_config_preset(path.c_str(), nullptr, 0, &needed) != SPLAT_INCOMPLETE)
        throw Failure(kUsageError, "there is no file '" + path + "', and " + library_message());
    std::string text(needed, '\0');
    check(splat_config_preset(path.c_str(), text.data(), needed, nullptr));
    return text.c_str();
}

Json merged_config(const std::string& path, const std::vector<std::string>& changes) {
    const std::string text = path.empty() ? "" : config_text(path);
    std::vector<const char*> values;
    for (const std::string& change : changes) values.push_back(change.c_str());
    std::size_t needed = 0;
    const char* const from = path.empty() ? nullptr : text.c_str();
    const splat_result result =
        splat_config_merge(from, values.data(), values.size(), nullptr, 0, &needed);
    if (result != SPLAT_INCOMPLETE)
        throw Failure(kUsageError, (path.empty() ? "" : path + ": ") + library_message());
    std::string made(needed, '\0');
    check(splat_config_merge(from, values.data(), values.size(), made.data(), needed, nullptr));
    return Json::parse(made.c_str());
}

std::string find_config(const std::string& weights) {
    namespace fs = std::filesystem;
    const fs::path file = splat::os::path_of(weights);
    for (const std::string& name :
         {splat::os::text_of(file.stem()) + ".json", splat::os::text_of(file.stem()) + ".yaml",
          std::string("config.json"), std::string("config.yaml")})
        if (const fs::path path = file.parent_path() / splat::os::path_of(name); fs::exists(path))
            return splat::os::text_of(path);
    return "";
}

std::string config_beside(const std::string& weights, const std::string& given,
                          const std::string& adapters) {
    if (!given.empty()) return given;
    if (const std::string own = config_target(adapters);
        !adapters.empty() && std::filesystem::is_regular_file(splat::os::path_of(own)))
        return own;
    return find_config(weights);
}

std::string adapters_beside(const std::string& weights, const std::string& given) {
    namespace fs = std::filesystem;
    const fs::path path = splat::os::path_of(given);
    if (given.empty() || path.has_parent_path() || path.has_extension() ||
        fs::is_regular_file(path))
        return given;
    const fs::path folder = splat::os::path_of(weights).parent_path();
    fs::path file = folder / splat::os::path_of(given + ".safetensors");
    std::error_code none;
    if (fs::exists(file, none)) return splat::os::text_of(file);
    throw Failure(kBadData, "no adapters '" + given + "' beside the weights: there is no file '" +
                                splat::os::text_of(file) + "'; give the path of a file");
}

std::string config_target(const std::string& weights) {
    return splat::os::text_of(splat::os::path_of(weights).replace_extension(".json"));
}

void check_config_target(const std::string& weights, const Json& config, bool overwrite,
                         const std::string& read) {
    const std::string path = config_target(weights);
    std::error_code none;
    const bool is_read =
        std::filesystem::equivalent(splat::os::path_of(path), splat::os::path_of(read), none);
    if ((overwrite && !is_read) || !std::filesystem::exists(splat::os::path_of(path))) return;
    if (Json::parse(read_text(path), nullptr, false) == config) return;
    check_target(path, true, {read});
    throw Failure(kUsageError,
                  "'" + path + "', the place for the configuration of '" + weights +
                      "', exists with other contents: choose another name, or pass --overwrite");
}

void write_config_beside(const std::string& weights, const Json& config) {
    replace_file(config_target(weights), config.dump(2) + "\n");
}

}  // namespace vkrun

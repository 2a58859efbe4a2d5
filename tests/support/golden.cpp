#include "support/golden.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "core/environment.h"
#include "core/os/path.h"

namespace splat::test {

std::optional<std::string> golden_folder() {
    const std::string folder = environment("SPLAT_GOLDEN_DIR").value_or(SPLAT_GOLDEN_DIR_DEFAULT);
    std::error_code failed;
    if (!std::filesystem::is_directory(folder, failed)) return std::nullopt;
    return folder;
}

std::vector<std::string> golden_files(const std::string& subfolder, const std::string& family) {
    const auto folder = golden_folder();
    if (!folder) return {};
    std::vector<std::string> paths;
    std::error_code failed;
    for (const auto& entry :
         std::filesystem::directory_iterator(*folder + "/" + subfolder, failed)) {
        const std::string name = entry.path().filename().string();
        if (name.starts_with(family) && (name.ends_with(".npz") || name.ends_with(".npz.xz")))
            paths.push_back(os::text_of(entry.path()));
    }
    std::sort(paths.begin(), paths.end());
    if (paths.empty())
        ADD_FAILURE() << *folder << "/" << subfolder << " holds no file " << family
                      << "*.npz or *.npz.xz";
    return paths;
}

std::string golden_name(const std::string& path) {
    const std::string file = std::filesystem::path(path).filename().string();
    return file.substr(0, file.rfind(".npz"));
}

bool is_shipped_golden(const std::string& path, const std::string& family) {
    return !environment("SPLAT_GOLDEN_DIR") && golden_name(path) == family;
}

}  // namespace splat::test

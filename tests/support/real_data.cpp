#include "support/real_data.h"

#include <filesystem>

#include "core/environment.h"

namespace splat::test {

std::optional<std::string> real_data_folder() {
    const std::string folder = environment("SPLAT_REAL_DIR").value_or(SPLAT_REAL_DIR_DEFAULT);
    std::error_code failed;
    if (!std::filesystem::is_directory(folder, failed)) return std::nullopt;
    return folder;
}

}  // namespace splat::test

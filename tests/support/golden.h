#pragma once

#include <optional>
#include <string>
#include <vector>

namespace splat::test {

/// Folder of the golden files: SPLAT_GOLDEN_DIR, else tests/golden; nothing if it does not exist.
std::optional<std::string> golden_folder();

/// Paths of `<folder>/<subfolder>/<family>*.npz`, sorted. Other seeds and sizes of a family may be
/// added under further names. Fails the test if the folder exists without such a file.
std::vector<std::string> golden_files(const std::string& subfolder, const std::string& family);

/// The name of a golden file, without .npz or .npz.xz.
std::string golden_name(const std::string& path);

/// True if the path is `<family>` of tests/golden, not of SPLAT_GOLDEN_DIR or of another name.
bool is_shipped_golden(const std::string& path, const std::string& family);

}  // namespace splat::test

/// Skips the running test, visibly, where there is no folder of golden files.
#define SPLAT_NEEDS_GOLDEN_FOLDER()                                                      \
    if (!::splat::test::golden_folder())                                                 \
    GTEST_SKIP() << "no folder of golden files: set SPLAT_GOLDEN_DIR to one that holds " \
                    "net/ and raster/"

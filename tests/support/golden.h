#pragma once

#include <optional>
#include <string>
#include <vector>

namespace splat::test {

/// Folder of the golden files: SPLAT_GOLDEN_DIR, else tests/golden; nothing if it does not exist.
std::optional<std::string> golden_folder();

/// Paths of `<folder>/<subfolder>/<family>*.npz`, sorted. Other seeds and sizes of a family may be
/// added under further names. Records a test failure if the folder is there and holds no such file.
std::vector<std::string> golden_files(const std::string& subfolder, const std::string& family);

}  // namespace splat::test

/// Skip the running test, visibly, where there are no golden files at all.
#define SPLAT_NEEDS_GOLDEN_FOLDER()                                                      \
    if (!::splat::test::golden_folder())                                                 \
    GTEST_SKIP() << "no folder of golden files: set SPLAT_GOLDEN_DIR to one that holds " \
                    "net/ and raster/"

#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <string>

namespace splat::test {

/// Folder of scenes, photographs and files of other programs, which are not part of the repository:
/// SPLAT_REAL_DIR, else ../shared/real next to the source tree; nothing if it does not exist.
std::optional<std::string> real_data_folder();

}  // namespace splat::test

/// Skips the running test, visibly, where there is no folder of real data.
#define SPLAT_NEEDS_REAL_DATA()                                                                 \
    if (!::splat::test::real_data_folder())                                                     \
    GTEST_SKIP() << "no folder of real data: set SPLAT_REAL_DIR to one that holds scenes/ and " \
                    "format_fixtures/"

#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "core/status.h"
#include "data/dataset_export.h"
#include "synthetic/sample_folder.h"
#include "tables/session.h"

namespace splat::test {

/// The test is skipped unless DuckDB's library can be loaded.
#define SPLAT_NEED_DUCKDB()                                         \
    if (const auto found = tables::duckdb_library(""); !found.ok()) \
    GTEST_SKIP() << "no DuckDB library: " << found.status().message()

/// Run statements in one session that sees the folder. Errors: those of Session.
Status run_sql(const std::filesystem::path& folder, const std::vector<std::string>& statements);

/// The first column of the first row of a query, as text.
Result<std::string> ask_sql(const std::filesystem::path& folder, const std::string& query);

/// Write a split of a data set in SRN's layout to another layout.
Status convert(const std::filesystem::path& from, const std::string& split, data::Layout layout,
               const std::filesystem::path& to, const tables::Progress& progress = nullptr);

/// A folder with sample_cars() in srn/.
class CarsFolder : public SampleFolder {
  public:
    CarsFolder() { write_all(sample_cars(*this / "srn")); }
};

/// Relative paths of all files of a folder that have one of these extensions, each with its bytes.
std::string tree_of(const std::filesystem::path& folder,
                    const std::vector<std::string>& extensions);

}  // namespace splat::test

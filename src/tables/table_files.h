#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/status.h"
#include "tables/table_kind.h"

namespace splat::tables {

/// The Parquet files of one table, in the order of their names.
struct TableFiles {
    Table table = Table::kIntrinsics;
    std::vector<std::string> files;
    bool split_column = false;  ///< rows of other splits lie in the same files
};

/// The folder has the layout of tables: folders of Parquet files named after the tables ("rgbs", "srn_cars_rgbs"),
/// or Parquet files of such names.
Result<bool> is_tables(const std::string& folder);

/// The tables of a split, in the order of kTables:
///   <table>/<split>/*.parquet      any number of files
///   <name>_<table>.parquet         one file for all splits, or several named <name>_<table>-00000-of-00002.parquet;
///                                  the column "split" says which rows belong to a split
///
/// Errors   kNotFound, naming the folder: no files of a required table, or none of the split; kFormat for tables
///          without the split that others have; kInvalidArgument for the tables of several data sets
Result<std::vector<TableFiles>> find_tables(const std::string& folder, const std::string& split);

/// Bytes of all files together.
std::uint64_t bytes_of(const std::vector<TableFiles>& tables);

/// Names, sizes and times of the files: equal texts, equal tables.
std::string fingerprint_of(const std::vector<TableFiles>& tables);

}  // namespace splat::tables

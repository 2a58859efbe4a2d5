#pragma once

#include <string>
#include <vector>

#include "core/status.h"
#include "tables/session.h"
#include "tables/table_kind.h"

namespace splat::tables {

/// Rows of a group, of rows of so many bytes: 512, fewer of large images. Random access to larger groups is slow,
/// and DuckDB takes several times their bytes to write them.
std::size_t row_group(std::uint64_t row_bytes);

/// Columns of a table without its split.
std::vector<WrittenColumn> columns_of(Table table);

/// Write one file of a table, `<folder>/<table>/<split>/<name>.parquet`: the path holds all of it or nothing.
/// Errors: those of `next`, kIo.
Status write_table_file(Session& session, const std::string& path, Table table, const NextRow& next,
                        std::size_t group);

/// README.md of a folder of tables: a YAML header with a configuration "srn_<category>_<table>" for each table
/// and its files of each split.
std::string table_card(const std::string& category, const std::vector<Table>& tables,
                       const std::vector<std::string>& splits, std::uint32_t resolution);

}  // namespace splat::tables

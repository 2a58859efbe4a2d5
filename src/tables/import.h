#pragma once

#include <functional>
#include <string>

#include "core/status.h"
#include "tables/store.h"

namespace splat::tables {

/// Called with the rows done and the rows of all tables; an error stops the work.
using Progress = std::function<Status(std::uint64_t done, std::uint64_t total)>;

struct ImportDesc {
    std::string path;             ///< folder of the tables, see find_tables()
    std::string split;            ///< "train", "val" or "test"
    std::string store;            ///< folder of the store of this split
    std::string library;          ///< see duckdb_library()
    bool replace = false;         ///< another store in the folder is removed
    Part part = {};               ///< the rows of each file that are copied
    bool* lacks_split = nullptr;  ///< not null: true if the error is that the tables lack the split
};

/// Copy the tables of a split to a store, each row once, joined by uuid and frame. What a killed process left is
/// continued at its last row group; a complete store is left alone. Takes less than 512 MiB of memory whatever
/// the tables' size.
///
/// Errors   kFormat with table, column, file and row: missing columns, ids that are missing or occur twice, values
///          of wrong lengths, damaged files; those of find_tables(), duckdb_library(), StoreWriter, `progress`
Status import_tables(const ImportDesc& desc, const Progress& progress);

}  // namespace splat::tables

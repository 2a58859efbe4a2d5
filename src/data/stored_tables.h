#pragma once

#include "data/dataset_reader.h"

namespace splat::data {

/// A store of tables' rows (src/tables/store.h), or a folder of stores named after their splits.
///
/// Errors   kNotFound, naming the splits that are there; kFormat for damaged files
Result<std::unique_ptr<DatasetReader>> open_store(const ReaderDesc& desc);

/// Where open_tables() keeps the store of a split: <path>/.splat/<split>.
std::string store_beside(const std::string& path, const std::string& split);

/// Tables in Parquet files: imported to store_beside() unless that is there from the same files, then read from it.
///
/// Errors   as tables::import_tables(); those of open_store()
Result<std::unique_ptr<DatasetReader>> open_tables(const ReaderDesc& desc);

}  // namespace splat::data

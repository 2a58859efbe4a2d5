#pragma once

#include <string>
#include <vector>

#include "core/status.h"
#include "tables/duckdb_api.h"

namespace splat::tables {

/// DuckDB's library, loaded once for the life of the process: `path` if it is not empty, else the file that
/// SPLAT_DUCKDB_LIBRARY names, else libduckdb.so beside libsplat, else the loader's. Thread-safe.
///
/// Errors   kNotFound, saying how to get it; kUnsupported for a library that lacks a function
Result<const duckdb::Api*> duckdb_library(const std::string& path);

}  // namespace splat::tables

#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/no_copy.h"
#include "core/status.h"
#include "tables/duckdb_library.h"

namespace splat::tables {

/// Rows of a query, in pieces of at most 2,048. Text and blobs are valid until the next piece.
class Rows : NoCopy {
  public:
    Rows(const duckdb::Api& api, duckdb::QueryResult result);
    ~Rows();

    /// Get the next piece; its number of rows, 0 at the end. Errors: kFormat, kOutOfHostMemory with DuckDB's
    /// sentence.
    Result<std::size_t> next();

    [[nodiscard]] bool is_null(std::size_t column, std::size_t row) const;
    [[nodiscard]] std::int64_t integer(std::size_t column, std::size_t row) const;   ///< BIGINT
    [[nodiscard]] std::string_view text(std::size_t column, std::size_t row) const;  ///< or blob

  private:
    const duckdb::Api& api_;
    duckdb::QueryResult result_;
    duckdb::Chunk chunk_ = nullptr;
    std::vector<duckdb::Vector> vectors_;
};

/// A cell of a row to write.
using Cell = std::variant<std::string_view, std::int64_t>;

struct WrittenColumn {
    const char* name;
    enum class Type { kText, kInteger, kBlob } type;
};

/// Fills the cells of the next row, which must stay valid until the call after; false at the end.
using NextRow = std::function<Result<bool>(std::vector<Cell>& cells)>;

/// DuckDB in memory, confined to some folders: no other file, no network, no extension, no settings that SQL
/// could change, one thread, 352 MiB. One call at a time.
class Session : NoCopy {
  public:
    /// `library` as duckdb_library() takes it. Errors: as there; kUnsupported for a DuckDB without one of these
    /// limits.
    static Result<std::unique_ptr<Session>> open(const std::string& library,
                                                 const std::vector<std::string>& folders);
    ~Session();

    /// Run a statement. Rows come as they are read. Errors: kFormat, kOutOfHostMemory with DuckDB's sentence.
    Result<std::unique_ptr<Rows>> query(const std::string& sql);

    /// Write a Parquet file, compressed by snappy, in row groups of `group` rows. Errors: those of `next`; kIo
    /// with DuckDB's sentence; a part of the file may remain.
    Status write_parquet(const std::string& path, const std::vector<WrittenColumn>& columns,
                         const NextRow& next, std::size_t group);

  private:
    explicit Session(const duckdb::Api& api) : api_(api) {}
    Status confine(const std::vector<std::string>& folders);
    Status run(const std::string& sql, Code code);

    const duckdb::Api& api_;
    duckdb::Database database_ = nullptr;
    duckdb::Connection connection_ = nullptr;
    std::size_t functions_ = 0;  ///< table functions registered so far
};

/// A text as an SQL literal: quoted.
std::string sql_literal(std::string_view text);
/// A name as an SQL identifier: quoted.
std::string sql_name(std::string_view name);

}  // namespace splat::tables

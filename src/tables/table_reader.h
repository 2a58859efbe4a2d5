#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "core/status.h"
#include "tables/session.h"
#include "tables/table_files.h"

namespace splat::tables {

/// A row of a table. Texts are valid during the call that gives it.
struct TableRow {
    std::uint64_t number = 0;  ///< row in the file, from 0
    std::string_view uuid;
    std::int64_t frame = 0;  ///< only in tables with frames
    std::string_view value;  ///< text, or an image: raw, or encoded as a file
};

/// Reads the rows of one table and split, file by file in the order of the file, never by position across
/// tables. Messages name table, file, column and row.
class TableReader {
  public:
    /// Check the columns of each file. A binary column of another name is taken, with a warning, if it is the only
    /// one. Errors: kFormat for missing columns and other types; those of DuckDB.
    static Result<TableReader> open(Session& session, const TableFiles& table,
                                    const std::string& split);

    [[nodiscard]] Table table() const { return table_.table; }
    [[nodiscard]] const std::vector<std::string>& files() const { return table_.files; }
    /// The values are images as files (struct{bytes,path}), not as raw numbers.
    [[nodiscard]] bool encoded(std::size_t file) const { return columns_[file].encoded; }

    using Take = std::function<Status(const TableRow&)>;

    /// All rows of a file, without their values. Errors: those of `take`; kFormat for missing or bad ids, and for a
    /// file with fewer rows than it says.
    Status keys(std::size_t file, const Take& take) const;

    /// Rows of a file, in all its splits.
    [[nodiscard]] std::uint64_t rows(std::size_t file) const { return columns_[file].rows; }

    /// Rows of a file from number `first` to before `last`, with their values. Errors: as keys(); kFormat for a value
    /// of more than `most` bytes; kUnsupported for row groups that do not fit in the memory of a session.
    Status values(std::size_t file, std::uint64_t first, std::uint64_t last, std::uint64_t most,
                  const Take& take) const;

    /// The error with "table rgbs, column rgb, row 12 of 'file'" before its message.
    [[nodiscard]] Status in_row(std::size_t file, std::uint64_t row, const Status& status) const;

  private:
    /// SQL expressions of a file's columns.
    struct Columns {
        std::string value, name;
        bool encoded = false;
        std::uint64_t rows = 0;  ///< rows of the file, of all splits
    };

    TableReader(Session& session, TableFiles table, std::string split)
        : session_(&session), table_(std::move(table)), split_(std::move(split)) {}
    [[nodiscard]] bool has_frames() const { return table_.table != Table::kIntrinsics; }
    Result<Columns> columns_of(const std::string& file) const;
    Status scan(std::size_t file, const std::string& select, std::uint64_t most,
                std::uint64_t first, std::uint64_t last, const Take& take,
                std::uint64_t& count) const;
    Status take_row(const Rows& rows, std::size_t row, std::size_t file, std::uint64_t most,
                    const Take& take) const;

    Session* session_;
    TableFiles table_;
    std::string split_;
    std::vector<Columns> columns_;  ///< columns of each file
};

}  // namespace splat::tables

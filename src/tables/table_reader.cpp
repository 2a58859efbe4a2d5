#include "tables/table_reader.h"

#include <algorithm>

#include "core/log.h"
#include "core/number_in.h"
#include "core/shown.h"

namespace splat::tables {
namespace {

/// DuckDB reads as many rows at once where a row group holds them. Where memory is too small for that, shorter
/// ranges of rows may fit.
constexpr std::uint64_t kPieceRows = 2048;
/// Bytes of a piece's values, which DuckDB copies beyond its limit of memory: a dictionary of one long value unpacks to
/// as many of them as there are rows.
constexpr std::uint64_t kPieceBytes = std::uint64_t{256} << 20;
constexpr std::int64_t kMaxFrame = 0x7FFFFFFF;
constexpr std::size_t kMaxFrameBytes = 64;  ///< most bytes of a frame's text, with zeros before it
constexpr std::size_t kMaxUuidBytes = 255;  ///< the name of a folder, when it is exported

constexpr const char* kNoValue = "''";

/// A column of a file, with DuckDB's name of its type.
struct FileColumn {
    std::string name, type;
    [[nodiscard]] bool is_integer() const {
        const std::string_view types =
            " TINYINT SMALLINT INTEGER BIGINT UTINYINT USMALLINT UINTEGER UBIGINT ";
        return types.find(" " + type + " ") != std::string_view::npos;
    }
    /// A struct with a blob named "bytes", not within a list or another struct.
    [[nodiscard]] bool has_bytes() const {
        constexpr std::string_view kField = "bytes BLOB";
        if (!type.starts_with("STRUCT(") || !type.ends_with(')')) return false;
        int depth = 0;
        for (std::size_t i = 0; i < type.size(); ++i) {
            const bool starts = type[i] == '(' || (type[i] == ',' && type[i + 1] == ' ');
            depth += type[i] == '(' ? 1 : type[i] == ')' ? -1 : 0;
            const std::size_t field = i + (type[i] == ',' ? 2 : 1);
            if (starts && depth == 1 && type.compare(field, kField.size(), kField) == 0 &&
                (type[field + kField.size()] == ',' || type[field + kField.size()] == ')'))
                return true;
        }
        return false;
    }
    [[nodiscard]] bool is_binary() const { return type == "BLOB" || has_bytes(); }
};
using FileColumns = std::vector<FileColumn>;

/// What a column must hold, and how pandas makes it of the column %s.
struct Expected {
    const char* what;
    const char* remedy;
};

constexpr Expected kIntegers = {"integers or text", "df['%s'].astype('int64')"};
constexpr Expected kText = {"text", "df['%s'].str.decode('utf-8')"};
constexpr Expected kBytes = {"bytes or struct{bytes, path}",
                             "[numpy.uint8(numbers).tobytes() for numbers in df['%s']]"};

Status other_type(const std::string& column, const Expected& expected) {
    std::string remedy = expected.remedy;
    remedy.replace(remedy.find("%s"), 2, column);
    return damaged(
        "column %s holds values of another type than %s: write it so, in pandas by "
        "df['%s'] = %s",
        column.c_str(), expected.what, column.c_str(), remedy.c_str());
}

Status no_column(const char* name, const FileColumns& columns) {
    const std::string names = joined(columns, &FileColumn::name);
    return damaged("there is no column %s; columns: %s", name,
                   names.empty() ? "none" : names.c_str());
}

FileColumns::const_iterator column_named(const FileColumns& columns, std::string_view name) {
    return std::ranges::find_if(columns,
                                [name](const FileColumn& column) { return column.name == name; });
}

/// The column of the values; where a table of images has none of that name, the only binary one.
Result<FileColumn> value_column(Table table, const std::string& file, const FileColumns& columns) {
    const TableKind kind = kind_of(table);
    const bool image = kind.map != nullptr;
    auto found = column_named(columns, kind.column);
    const auto is_binary = [](const FileColumn& column) { return column.is_binary(); };
    if (found == columns.end() && image && std::ranges::count_if(columns, is_binary) == 1) {
        found = std::ranges::find_if(columns, is_binary);
        log(LogLevel::kWarning,
            format("table %s, '%s': column '%s', the only binary one, is taken as %s", kind.name,
                   file.c_str(), found->name.c_str(), kind.column));
    }
    if (found == columns.end()) return no_column(kind.column, columns);
    if (image ? !found->is_binary() : found->type != "VARCHAR")
        return other_type(found->name, image ? kBytes : kText);
    return *found;
}

}  // namespace

Result<TableReader> TableReader::open(Session& session, const TableFiles& table,
                                      const std::string& split) {
    TableReader reader(session, table, split);
    for (const std::string& file : table.files) {
        auto columns = reader.columns_of(file);
        if (!columns.ok())
            return Status(columns.status().code(),
                          format("table %s, '%s': %s", kind_of(table.table).name, file.c_str(),
                                 columns.status().message().c_str()));
        reader.columns_.push_back(std::move(columns.value()));
    }
    return reader;
}

Result<TableReader::Columns> TableReader::columns_of(const std::string& file) const {
    const std::string path = sql_literal(file);
    const auto each_row = [&](const std::string& sql, const auto& take) -> Status {
        SPLAT_ASSIGN(const auto rows, session_->query(sql));
        while (true) {
            SPLAT_ASSIGN(const std::size_t more, rows->next());
            for (std::size_t row = 0; row < more; ++row) take(*rows, row);
            if (more == 0) return {};
        }
    };
    Columns out;
    SPLAT_TRY(each_row("SELECT CAST(num_rows AS BIGINT) FROM parquet_file_metadata(" + path + ")",
                       [&](const Rows& rows, std::size_t row) {
                           out.rows = static_cast<std::uint64_t>(rows.integer(0, row));
                       }));
    // A folder named "split=x" is part of the path, not the value of a column.
    FileColumns columns;
    SPLAT_TRY(each_row(
        "SELECT column_name, column_type FROM (DESCRIBE SELECT * FROM read_parquet(" + path +
            ", hive_partitioning = false))",
        [&](const Rows& rows, std::size_t row) {
            columns.push_back({std::string(rows.text(0, row)), std::string(rows.text(1, row))});
        }));
    const struct {
        const char* name;
        bool wanted, may_be_integer;
    } ids[] = {{"uuid", true, false},
               {"frame_id", has_frames(), true},
               {"split", table_.split_column, false}};
    for (const auto& id : ids) {
        if (!id.wanted) continue;
        const auto found = column_named(columns, id.name);
        if (found == columns.end()) return no_column(id.name, columns);
        if (found->type != "VARCHAR" && !(id.may_be_integer && found->is_integer()))
            return other_type(id.name, id.may_be_integer ? kIntegers : kText);
    }
    SPLAT_ASSIGN(const FileColumn value, value_column(table_.table, file, columns));
    out.name = value.name;
    out.encoded = value.has_bytes();
    out.value = sql_name(value.name);
    if (out.encoded) out.value = "struct_extract(" + out.value + ", 'bytes')";
    return out;
}

Status TableReader::in_row(std::size_t file, std::uint64_t row, const Status& status) const {
    return Status(status.code(),
                  format("table %s, column %s, row %llu of '%s': %s", kind_of(table_.table).name,
                         columns_[file].name.c_str(), llu(row), table_.files[file].c_str(),
                         status.message().c_str()));
}

Status TableReader::take_row(const Rows& rows, std::size_t row, std::size_t file,
                             std::uint64_t most, const Take& take) const {
    TableRow out;
    out.number = static_cast<std::uint64_t>(rows.integer(0, row));
    const auto bad = [&](const char* column, const std::string& problem) {
        return damaged("table %s, column %s, row %llu of '%s': %s", kind_of(table_.table).name,
                       column, llu(out.number), table_.files[file].c_str(), problem.c_str());
    };
    if (rows.is_null(1, row)) return bad("uuid", "the value is missing");
    out.uuid = rows.text(1, row);
    if (out.uuid.size() > kMaxUuidBytes)
        return bad("uuid", format("more than %zu bytes", kMaxUuidBytes));
    if (has_frames()) {
        if (rows.is_null(2, row)) return bad("frame_id", "the value is missing");
        const std::string_view text = rows.text(2, row);
        if (text.size() > kMaxFrameBytes)
            return bad("frame_id", format("more than %zu bytes", kMaxFrameBytes));
        out.frame = number_in<std::int64_t>(text).value_or(-1);
        if (out.frame < 0 || out.frame > kMaxFrame)
            return bad("frame_id",
                       format("'%.*s' is no number from 0 to %lld", static_cast<int>(text.size()),
                              text.data(), lld(kMaxFrame)));
    }
    if (rows.is_null(4, row)) return bad(columns_[file].name.c_str(), "the value is missing");
    if (rows.is_null(3, row))
        return bad(columns_[file].name.c_str(), format("%lld bytes, expected at most %llu",
                                                       lld(rows.integer(4, row)), llu(most)));
    out.value = rows.text(3, row);
    return take(out);
}

Status TableReader::scan(std::size_t file, const std::string& select, std::uint64_t most,
                         std::uint64_t first, std::uint64_t last, const Take& take,
                         std::uint64_t& count) const {
    const std::string frame =
        has_frames() ? format("left(CAST(frame_id AS VARCHAR), %zu)", kMaxFrameBytes + 1) : "''";
    const bool image = kind_of(table_.table).map != nullptr && select != kNoValue;
    const std::string bytes = (image ? "octet_length(" : "strlen(") + select + ")";
    std::string sql =
        format("SELECT file_row_number, left(uuid, %zu), ", kMaxUuidBytes + 1) + frame +
        ", CASE WHEN " + bytes + format(" <= %llu THEN ", llu(most)) + select + " END, CAST(" +
        bytes + " AS BIGINT) FROM read_parquet(" + sql_literal(table_.files[file]) +
        ", file_row_number = true, hive_partitioning = false) WHERE file_row_number >= " +
        std::to_string(first) + " AND file_row_number < " + std::to_string(last);
    if (table_.split_column) sql += " AND split = " + sql_literal(split_);
    const auto rows = session_->query(sql);
    if (!rows.ok()) return in_row(file, first, rows.status());
    while (true) {
        const auto got = rows.value()->next();
        if (!got.ok()) return in_row(file, first + count, got.status());
        if (got.value() == 0) return {};
        for (std::size_t row = 0; row < got.value(); ++row)
            SPLAT_TRY(take_row(*rows.value(), row, file, most, take));
        count += got.value();
    }
}

Status TableReader::keys(std::size_t file, const Take& take) const {
    std::uint64_t count = 0;
    const std::uint64_t rows = columns_[file].rows;
    SPLAT_TRY(scan(file, kNoValue, 0, 0, rows, take, count));
    if (table_.split_column || count == rows) return {};
    return damaged("table %s, '%s': %llu rows, but its footer says %llu",
                   kind_of(table_.table).name, table_.files[file].c_str(), llu(count), llu(rows));
}

Status TableReader::values(std::size_t file, std::uint64_t first, std::uint64_t last,
                           std::uint64_t most, const Take& take) const {
    std::uint64_t step = std::max<std::uint64_t>(last, 1);
    if (most > kPieceBytes / kPieceRows) step = std::max<std::uint64_t>(1, kPieceBytes / most);
    std::uint64_t next = first;
    bool refused = false;
    const auto count_and_take = [&](const TableRow& row) -> Status {
        const Status status = take(row);
        refused = !status.ok();
        next = row.number + 1;
        return status;
    };
    while (next < last) {
        const std::uint64_t end = std::min(last, next + step);
        std::uint64_t count = 0;
        const Status status =
            scan(file, columns_[file].value, most, next, end, count_and_take, count);
        if (status.ok())
            next = end;
        else if (refused || status.code() != Code::kOutOfHostMemory)
            return status;
        else if (step == 1)
            return unsupported(
                "%s; a row group does not fit in the memory that is set for it: write "
                "the file again with at most %llu rows and 100 MiB in a group",
                status.message().c_str(), llu(kPieceRows / 4));
        else
            step = std::max<std::uint64_t>(1, std::min(step, kPieceRows) / 4);
    }
    return {};
}

}  // namespace splat::tables

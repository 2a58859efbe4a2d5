#include "tables/table_reader.h"

#include <algorithm>
#include <charconv>

#include "core/log.h"

namespace splat::tables {
namespace {

using duckdb::Type;

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

bool is_binary(const Rows::Column& column) {
    return column.type == Type::kBlob || column.has_bytes;
}

bool is_integer(Type type) {
    return type >= Type::kTinyint && type <= Type::kUbigint;
}

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
    return error(Code::kFormat,
                 "column %s holds values of another type than %s: write it so, in pandas by "
                 "df['%s'] = %s",
                 column.c_str(), expected.what, column.c_str(), remedy.c_str());
}

std::string names_of(const std::vector<Rows::Column>& columns) {
    std::string names;
    for (const Rows::Column& column : columns) names += (names.empty() ? "" : ", ") + column.name;
    return names.empty() ? "none" : names;
}

const Rows::Column* column_named(const std::vector<Rows::Column>& columns, const char* name) {
    const auto found = std::find_if(columns.begin(), columns.end(),
                                    [name](const auto& column) { return column.name == name; });
    return found == columns.end() ? nullptr : &*found;
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
    SPLAT_ASSIGN(const auto count, session_->query("SELECT CAST(num_rows AS BIGINT) FROM "
                                                   "parquet_file_metadata(?)",
                                                   {file}));
    Columns out;
    SPLAT_ASSIGN(const std::size_t rows, count->next());
    if (rows > 0) out.rows = static_cast<std::uint64_t>(count->integer(0, 0));
    while (true) {
        SPLAT_ASSIGN(const std::size_t more, count->next());
        if (more == 0) break;
    }
    // A folder named "split=x" is part of the path, not the value of a column.
    SPLAT_ASSIGN(const auto none,
                 session_->query("SELECT * FROM read_parquet(?, hive_partitioning = false) LIMIT 0",
                                 {file}));
    const std::vector<Rows::Column> columns = none->columns();
    for (const char* name : {"uuid", "frame_id", "split"}) {
        if (std::string_view(name) == "frame_id" && !has_frames()) continue;
        if (std::string_view(name) == "split" && !table_.split_column) continue;
        const Rows::Column* const found = column_named(columns, name);
        if (found == nullptr)
            return error(Code::kFormat, "there is no column %s; columns: %s", name,
                         names_of(columns).c_str());
        const bool text = found->type == Type::kVarchar;
        if (!text && !(std::string_view(name) == "frame_id" && is_integer(found->type)))
            return other_type(name, std::string_view(name) == "frame_id" ? kIntegers : kText);
    }
    SPLAT_ASSIGN(out.value, value_column(file, columns, out));
    return out;
}

Result<std::string> TableReader::value_column(const std::string& file,
                                              std::vector<Rows::Column> columns,
                                              Columns& out) const {
    const TableKind kind = kind_of(table_.table);
    const Rows::Column* found = column_named(columns, kind.column);
    const bool image = kind.map != nullptr;
    if (found == nullptr && image) {
        std::vector<Rows::Column> others = columns;
        std::erase_if(others, [](const auto& column) { return !is_binary(column); });
        if (others.size() == 1) {
            log(LogLevel::kWarning,
                format("table %s, '%s': column '%s', the only binary one, is taken as %s",
                       kind.name, file.c_str(), others.front().name.c_str(), kind.column));
            found = column_named(columns, others.front().name.c_str());
        }
    }
    if (found == nullptr)
        return error(Code::kFormat, "there is no column %s; columns: %s", kind.column,
                     names_of(columns).c_str());
    if (image ? !is_binary(*found) : found->type != Type::kVarchar)
        return other_type(found->name, image ? kBytes : kText);
    out.name = found->name;
    out.encoded = found->has_bytes;
    const std::string name = sql_name(found->name);
    return found->has_bytes ? "struct_extract(" + name + ", 'bytes')" : name;
}

Status TableReader::in_row(std::size_t file, std::uint64_t row, const Status& status) const {
    return Status(status.code(),
                  format("table %s, column %s, row %llu of '%s': %s", kind_of(table_.table).name,
                         columns_[file].name.c_str(), static_cast<unsigned long long>(row),
                         table_.files[file].c_str(), status.message().c_str()));
}

Status TableReader::take_row(const Rows& rows, std::size_t row, std::size_t file,
                             std::uint64_t most, const Take& take) const {
    TableRow out;
    out.number = static_cast<std::uint64_t>(rows.integer(0, row));
    const auto bad = [&](const char* column, const std::string& problem) {
        return error(Code::kFormat, "table %s, column %s, row %llu of '%s': %s",
                     kind_of(table_.table).name, column,
                     static_cast<unsigned long long>(out.number), table_.files[file].c_str(),
                     problem.c_str());
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
        const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), out.frame);
        if (code != std::errc() || end != text.data() + text.size() || out.frame < 0 ||
            out.frame > kMaxFrame)
            return bad("frame_id",
                       format("'%.*s' is no number from 0 to %lld", static_cast<int>(text.size()),
                              text.data(), static_cast<long long>(kMaxFrame)));
    }
    if (rows.is_null(4, row)) return bad(columns_[file].name.c_str(), "the value is missing");
    if (rows.is_null(3, row))
        return bad(columns_[file].name.c_str(), format("%lld bytes, expected at most %llu",
                                                       static_cast<long long>(rows.integer(4, row)),
                                                       static_cast<unsigned long long>(most)));
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
        ", CASE WHEN " + bytes + format(" <= %llu THEN ", static_cast<unsigned long long>(most)) +
        select + " END, CAST(" + bytes +
        " AS BIGINT) FROM read_parquet(?, file_row_number = true,"
        " hive_partitioning = false) WHERE file_row_number >= ? AND file_row_number < ?";
    std::vector<Parameter> parameters = {table_.files[file], static_cast<std::int64_t>(first),
                                         static_cast<std::int64_t>(last)};
    if (table_.split_column) {
        sql += " AND split = ?";
        parameters.emplace_back(split_);
    }
    const auto rows = session_->query(sql, parameters);
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
    return error(Code::kFormat, "table %s, '%s': %llu rows, but its footer says %llu",
                 kind_of(table_.table).name, table_.files[file].c_str(),
                 static_cast<unsigned long long>(count), static_cast<unsigned long long>(rows));
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
            return error(Code::kUnsupported,
                         "%s; a row group does not fit in the memory that is set for it: write "
                         "the file again with at most %llu rows and 100 MiB in a group",
                         status.message().c_str(), static_cast<unsigned long long>(kPieceRows / 4));
        else
            step = std::max<std::uint64_t>(1, std::min(step, kPieceRows) / 4);
    }
    return {};
}

}  // namespace splat::tables

// The rows of a file to write come to DuckDB from a table function, piece by piece.

#include <exception>

#include "tables/session.h"

namespace splat::tables {
namespace {

/// Most rows of one call of the function.
constexpr std::size_t kMaxCallRows = 2048;
constexpr std::size_t kMaxCallBytes = std::size_t{8} << 20;

/// The rows of a file, on the way to DuckDB.
struct RowSource {
    const duckdb::Api& api;
    const std::vector<WrittenColumn>& columns;
    const NextRow& next;
    Status status;  ///< what ended the rows
    bool ended = false;
    std::vector<Cell> cells = std::vector<Cell>(columns.size());
};

/// Rows of this thread's write_parquet(): DuckDB has one thread, the caller's, and its callbacks get no pointer
/// without calling the library.
thread_local RowSource* writing = nullptr;

duckdb::Type stored_type(WrittenColumn::Type type) {
    if (type == WrittenColumn::Type::kInteger) return duckdb::Type::kBigint;
    return type == WrittenColumn::Type::kText ? duckdb::Type::kVarchar : duckdb::Type::kBlob;
}

void bind_rows(duckdb::BindInfo info) {
    for (const WrittenColumn& column : writing->columns) {
        duckdb::LogicalType type = writing->api.create_logical_type(stored_type(column.type));
        writing->api.bind_add_result_column(info, column.name, type);
        writing->api.destroy_logical_type(&type);
    }
}

void start_rows(duckdb::InitInfo info) {
    writing->api.init_set_max_threads(info, 1);
}

/// Append one row to a piece. Returns its bytes of text.
std::size_t put_row(RowSource& source, duckdb::Chunk chunk, std::size_t row) {
    std::size_t bytes = 0;
    for (std::size_t i = 0; i < source.cells.size(); ++i) {
        duckdb::Vector vector = source.api.data_chunk_get_vector(chunk, i);
        if (const auto* const number = std::get_if<std::int64_t>(&source.cells[i])) {
            static_cast<std::int64_t*>(source.api.vector_get_data(vector))[row] = *number;
            continue;
        }
        const auto text = std::get<std::string_view>(source.cells[i]);
        source.api.vector_assign_string_element_len(vector, row, text.data(), text.size());
        bytes += text.size();
    }
    return bytes;
}

Status fill(RowSource& source, duckdb::Chunk chunk) {
    std::size_t rows = 0;
    for (std::size_t bytes = 0; rows < kMaxCallRows && bytes < kMaxCallBytes; ++rows) {
        SPLAT_ASSIGN(const bool more, source.next(source.cells));
        source.ended = !more;
        if (!more) break;
        bytes += put_row(source, chunk, rows);
    }
    source.api.data_chunk_set_size(chunk, rows);
    return {};
}

/// An exception must not pass through DuckDB.
void give_rows(duckdb::FunctionInfo info, duckdb::Chunk chunk) {
    RowSource& source = *writing;
    try {
        if (source.ended) return source.api.data_chunk_set_size(chunk, 0);
        source.status = fill(source, chunk);
    } catch (const std::bad_alloc&) {
        source.status = Status(Code::kOutOfHostMemory, "");
    } catch (const std::exception& failure) {
        source.status = Status(Code::kInternal, failure.what());
    }
    if (!source.status.ok()) source.api.function_set_error(info, "the rows ended with an error");
}

}  // namespace

Status Session::write_parquet(const std::string& path, const std::vector<WrittenColumn>& columns,
                              const NextRow& next, std::size_t group) {
    const std::string name = "rows_" + std::to_string(functions_++);
    RowSource source{api_, columns, next, {}};
    writing = &source;
    duckdb::TableFunction function = api_.create_table_function();
    api_.table_function_set_name(function, name.c_str());
    api_.table_function_set_bind(function, bind_rows);
    api_.table_function_set_init(function, start_rows);
    api_.table_function_set_function(function, give_rows);
    const bool known = api_.register_table_function(connection_, function) == duckdb::kSuccess;
    api_.destroy_table_function(&function);
    Status status = error(Code::kInternal, "DuckDB does not take a table function");
    if (known)
        status = run("COPY (SELECT * FROM " + name + "()) TO " + sql_literal(path) +
                         " (FORMAT parquet, COMPRESSION snappy, USE_TMP_FILE false, "
                         "ROW_GROUP_SIZE " +
                         std::to_string(group) + ")",
                     Code::kIo);
    writing = nullptr;
    return source.status.ok() ? status : source.status;
}

}  // namespace splat::tables

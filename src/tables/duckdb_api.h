#pragma once

#include <cstdint>

/// The part of DuckDB's C API that is used, as the header of its version 1 declares it (MIT licence). The library
/// is loaded at run time, so these declarations are all that the build needs.
namespace splat::tables::duckdb {

using State = int;  ///< kSuccess, or an error
inline constexpr State kSuccess = 0;
using Index = std::uint64_t;

using Config = struct ConfigTag*;
using Database = struct DatabaseTag*;
using Connection = struct ConnectionTag*;
using Prepared = struct PreparedTag*;
using Chunk = struct ChunkTag*;
using Vector = struct VectorTag*;
using LogicalType = struct LogicalTypeTag*;
using TableFunction = struct TableFunctionTag*;
using BindInfo = struct BindInfoTag*;
using InitInfo = struct InitInfoTag*;
using FunctionInfo = struct FunctionInfoTag*;

/// duckdb_result; only the library reads its members.
struct QueryResult {
    std::uint64_t column_count, row_count, rows_changed;
    void* columns;
    char* error_message;
    void* internal_data;
};

/// duckdb_string_t: up to 12 bytes lie in place.
union Text {
    struct {
        std::uint32_t length;
        char prefix[4];
        const char* at;
    } far;
    struct {
        std::uint32_t length;
        char bytes[12];
    } near;
};

enum class Type : std::uint32_t {
    kBigint = 5,
    kVarchar = 17,
    kBlob = 18,
};

/// F(result, name, parameters) of each function duckdb_<name>.
#define SPLAT_DUCKDB_FUNCTIONS(F)                                                        \
    F(const char*, library_version, ())                                                  \
    F(State, create_config, (Config*))                                                   \
    F(State, set_config, (Config, const char*, const char*))                             \
    F(void, destroy_config, (Config*))                                                   \
    F(State, open_ext, (const char*, Database*, Config, char**))                         \
    F(void, close, (Database*))                                                          \
    F(State, connect, (Database, Connection*))                                           \
    F(void, disconnect, (Connection*))                                                   \
    F(void, free, (void*))                                                               \
    F(State, query, (Connection, const char*, QueryResult*))                             \
    F(State, prepare, (Connection, const char*, Prepared*))                              \
    F(const char*, prepare_error, (Prepared))                                            \
    F(State, execute_prepared_streaming, (Prepared, QueryResult*))                       \
    F(void, destroy_prepare, (Prepared*))                                                \
    F(const char*, result_error, (QueryResult*))                                         \
    F(void, destroy_result, (QueryResult*))                                              \
    F(Index, column_count, (QueryResult*))                                               \
    F(LogicalType, create_logical_type, (Type))                                          \
    F(void, destroy_logical_type, (LogicalType*))                                        \
    F(Chunk, fetch_chunk, (QueryResult))                                                 \
    F(void, destroy_data_chunk, (Chunk*))                                                \
    F(Index, data_chunk_get_size, (Chunk))                                               \
    F(void, data_chunk_set_size, (Chunk, Index))                                         \
    F(Vector, data_chunk_get_vector, (Chunk, Index))                                     \
    F(void*, vector_get_data, (Vector))                                                  \
    F(std::uint64_t*, vector_get_validity, (Vector))                                     \
    F(void, vector_assign_string_element_len, (Vector, Index, const char*, Index))       \
    F(TableFunction, create_table_function, ())                                          \
    F(void, table_function_set_name, (TableFunction, const char*))                       \
    F(void, table_function_set_bind, (TableFunction, void (*)(BindInfo)))                \
    F(void, table_function_set_init, (TableFunction, void (*)(InitInfo)))                \
    F(void, table_function_set_function, (TableFunction, void (*)(FunctionInfo, Chunk))) \
    F(State, register_table_function, (Connection, TableFunction))                       \
    F(void, destroy_table_function, (TableFunction*))                                    \
    F(void, bind_add_result_column, (BindInfo, const char*, LogicalType))                \
    F(void, init_set_max_threads, (InitInfo, Index))                                     \
    F(void, function_set_error, (FunctionInfo, const char*))

struct Api {
#define SPLAT_DUCKDB_MEMBER(result, name, parameters) result(*name) parameters = nullptr;
    SPLAT_DUCKDB_FUNCTIONS(SPLAT_DUCKDB_MEMBER)
#undef SPLAT_DUCKDB_MEMBER
};

}  // namespace splat::tables::duckdb

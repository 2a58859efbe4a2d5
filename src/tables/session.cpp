#include "tables/session.h"

#include <algorithm>
#include <utility>

#include "core/shown.h"

namespace splat::tables {
namespace {

using duckdb::kSuccess;

/// Settings of every session. Reading a file of one row group and large pages takes about 390 MiB whatever its size.
constexpr std::pair<const char*, const char*> kSettings[] = {
    {"threads", "1"},  // two threads buffer twice the rows and are no faster
    {"memory_limit", "352MiB"},
    {"temp_directory", ""},
    {"autoinstall_known_extensions", "false"},
    {"autoload_known_extensions", "false"},
    {"allow_community_extensions", "false"},
};

/// DuckDB's sentence without what follows its first line.
std::string first_line(const char* text) {
    const std::string all = text == nullptr ? "no reason given" : text;
    return all.substr(0, all.find('\n'));
}

Status duckdb_error(const char* text, Code code = Code::kFormat) {
    const std::string sentence = first_line(text);
    const bool memory = sentence.find("Out of Memory") != std::string::npos;
    return Status(memory ? Code::kOutOfHostMemory : code, "DuckDB: " + sentence);
}

std::string quoted(std::string_view text, char quote) {
    std::string out(1, quote);
    for (const char c : text) out += std::string(c == quote ? 2 : 1, c);
    return out + quote;
}

}  // namespace

std::string sql_literal(std::string_view text) {
    return quoted(text, '\'');
}

std::string sql_name(std::string_view name) {
    return quoted(name, '"');
}

Rows::Rows(const duckdb::Api& api, duckdb::QueryResult result) : api_(api), result_(result) {}

Rows::~Rows() {
    if (chunk_ != nullptr) api_.destroy_data_chunk(&chunk_);
    api_.destroy_result(&result_);
}

Result<std::size_t> Rows::next() {
    if (chunk_ != nullptr) api_.destroy_data_chunk(&chunk_);
    vectors_.clear();
    chunk_ = api_.fetch_chunk(result_);
    if (chunk_ == nullptr) {
        const char* const problem = api_.result_error(&result_);
        if (problem != nullptr && *problem != 0) return duckdb_error(problem);
        return std::size_t{0};
    }
    const std::size_t count = api_.data_chunk_get_size(chunk_);
    for (std::size_t i = 0; i < api_.column_count(&result_); ++i)
        vectors_.push_back(api_.data_chunk_get_vector(chunk_, i));
    return count;
}

bool Rows::is_null(std::size_t column, std::size_t row) const {
    const std::uint64_t* const valid = api_.vector_get_validity(vectors_[column]);
    return valid != nullptr && ((valid[row / 64] >> (row % 64)) & 1U) == 0;
}

std::int64_t Rows::integer(std::size_t column, std::size_t row) const {
    return static_cast<const std::int64_t*>(api_.vector_get_data(vectors_[column]))[row];
}

std::string_view Rows::text(std::size_t column, std::size_t row) const {
    const auto& text =
        static_cast<const duckdb::Text*>(api_.vector_get_data(vectors_[column]))[row];
    const std::size_t length = text.near.length;
    return {length <= sizeof text.near.bytes ? text.near.bytes : text.far.at, length};
}

Session::~Session() {
    if (connection_ != nullptr) api_.disconnect(&connection_);
    if (database_ != nullptr) api_.close(&database_);
}

Result<std::unique_ptr<Session>> Session::open(const std::string& library,
                                               const std::vector<std::string>& folders) {
    SPLAT_ASSIGN(const duckdb::Api* api, duckdb_library(library));
    std::unique_ptr<Session> session(new Session(*api));
    duckdb::Config config = nullptr;
    if (api->create_config(&config) != kSuccess)
        return error(Code::kOutOfHostMemory, "DuckDB: no memory for its settings");
    const char* refused = nullptr;
    for (const auto& [name, value] : kSettings)
        if (api->set_config(config, name, value) != kSuccess) refused = name;
    char* problem = nullptr;
    const duckdb::State state = refused != nullptr
                                    ? kSuccess
                                    : api->open_ext(nullptr, &session->database_, config, &problem);
    api->destroy_config(&config);
    if (refused != nullptr)
        return unsupported("DuckDB %s does not take the setting '%s'", api->library_version(),
                           refused);
    if (state != kSuccess) {
        const Status status = duckdb_error(problem, Code::kUnsupported);
        api->free(problem);
        return status;
    }
    if (api->connect(session->database_, &session->connection_) != kSuccess)
        return error(Code::kOutOfHostMemory, "DuckDB: no connection");
    SPLAT_TRY(session->confine(folders));
    return session;
}

Status Session::confine(const std::vector<std::string>& folders) {
    // Without the first, a stream of rows buffers more than the limit of memory.
    for (const std::string& statement :
         {std::string("SET streaming_buffer_size = '1KB'"),
          "SET allowed_directories = [" + joined(folders, sql_literal) + "]",
          std::string("SET enable_external_access = false"),
          std::string("SET lock_configuration = true")})
        SPLAT_TRY(run(statement, Code::kUnsupported));
    return {};
}

Status Session::run(const std::string& sql, Code code) {
    duckdb::QueryResult result{};
    Status status;
    if (api_.query(connection_, sql.c_str(), &result) != kSuccess)
        status = duckdb_error(api_.result_error(&result), code);
    api_.destroy_result(&result);
    return status;
}

Result<std::unique_ptr<Rows>> Session::query(const std::string& sql) {
    duckdb::Prepared prepared = nullptr;
    duckdb::QueryResult result{};
    Status status;
    if (api_.prepare(connection_, sql.c_str(), &prepared) != kSuccess) {
        status = duckdb_error(api_.prepare_error(prepared));
    } else if (api_.execute_prepared_streaming(prepared, &result) != kSuccess) {
        status = duckdb_error(api_.result_error(&result));
        api_.destroy_result(&result);
    }
    api_.destroy_prepare(&prepared);
    if (!status.ok()) return status;
    return std::make_unique<Rows>(api_, result);
}

}  // namespace splat::tables

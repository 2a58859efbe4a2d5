#include "tables/duckdb_library.h"

#include <filesystem>
#include <map>
#include <memory>

#include "core/environment.h"
#include "core/fork.h"
#include "core/os/library.h"
#include "core/os/path.h"

namespace splat::tables {
namespace {

constexpr const char* kVariable = "SPLAT_DUCKDB_LIBRARY";
#if defined(_WIN32)
constexpr const char* kPackage = "@duckdb/node-bindings-win32-x64'";
#else
constexpr const char* kPackage = "@duckdb/node-bindings-linux-x64' (linux-arm64 on ARM)";
#endif

std::string file_name() {
    return os::library_file("duckdb");
}

/// How to get the library, after what was tried.
Status no_duckdb(const std::string& tried) {
    return not_found(
        "Parquet files are read and written by DuckDB, which was not found: %s. Get it with 'npm "
        "pack %s, unpack the .tgz, and set %s to its package/%s",
        tried.c_str(), kPackage, kVariable, file_name().c_str());
}

/// The places of the library: its path, and the words of an error.
struct Place {
    std::string path, name;
};

std::vector<Place> places(const std::string& path) {
    if (!path.empty()) return {{path, "the given library"}};
    if (const auto set = environment(kVariable)) return {{*set, kVariable}};
    const std::string beside = os::text_of(os::path_of(library_folder()) / file_name());
    return {{beside, "beside libsplat"}, {file_name(), "the loader's path"}};
}

Result<duckdb::Api> functions_of(void* library, const std::string& path) {
    duckdb::Api api;
    const char* missing = nullptr;
#define SPLAT_DUCKDB_FIND(result, name, parameters)                                             \
    api.name = reinterpret_cast<decltype(api.name)>(os::function_of(library, "duckdb_" #name)); \
    if (api.name == nullptr && missing == nullptr) missing = "duckdb_" #name;
    SPLAT_DUCKDB_FUNCTIONS(SPLAT_DUCKDB_FIND)
#undef SPLAT_DUCKDB_FIND
    if (missing == nullptr) return api;
    return unsupported("'%s' has no function %s, expected DuckDB's library of version 1.5 or later",
                       path.c_str(), missing);
}

Result<std::unique_ptr<duckdb::Api>> load(const std::string& path) {
    std::string tried;
    for (const Place& place : places(path)) {
        std::string failed;
        void* const library = os::load_library(place.path, failed);
        if (library != nullptr) {
            SPLAT_ASSIGN(const duckdb::Api api, functions_of(library, place.path));
            return std::make_unique<duckdb::Api>(api);
        }
        tried += (tried.empty() ? "" : "; ") + place.name + ": " + failed;
    }
    return no_duckdb(tried);
}

}  // namespace

Result<const duckdb::Api*> duckdb_library(const std::string& path) {
    static ForkMutex mutex;
    static std::map<std::string, std::unique_ptr<duckdb::Api>> loaded;
    const std::string key = path.empty() ? environment(kVariable).value_or("") : path;
    const std::lock_guard lock(mutex);
    const auto found = loaded.find(key);
    if (found != loaded.end()) return found->second.get();
    SPLAT_ASSIGN(std::unique_ptr<duckdb::Api> api, load(path));
    return (loaded[key] = std::move(api)).get();
}

}  // namespace splat::tables

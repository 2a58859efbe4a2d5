#pragma once

#include <functional>
#include <string>
#include <vector>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"

namespace CLI {
class App;
}  // namespace CLI

namespace vkrun {

/// Options of the commands that copy data sets.
struct TransferOptions {
    std::string source, out;
    std::string format;
    std::string layout = "tables";
    std::string category = "cars";
    std::string split = "all";
    std::string duckdb;
    std::string shard;  ///< part of a store
    std::uint32_t size = 0;
    bool black = false;
    bool allow_missing = false;
    bool json = false;
};

/// DIR, OUT, --duckdb, --json.
void add_transfer_options(CLI::App& command, TransferOptions& options);
/// --split of the source, or all.
void add_split_option(CLI::App& command, TransferOptions& options);
/// --to, --class, and those of the source.
void add_export_options(CLI::App& command, TransferOptions& options);
/// Throws a usage Failure for options that the layout does not take.
void check_effect(const CLI::App& command, const TransferOptions& options);
/// --format, --size, --black, --allow-missing.
void add_source_options(CLI::App& command, TransferOptions& options);

/// Call the library under a progress bar. Throws a Failure.
void with_progress(const std::string& what,
                   const std::function<splat_result(splat_progress_callback, void*)>& call);

/// Open a split of the source, without keeping images in memory. A missing one throws a Failure, unless `missing` is
/// given: it gets the sentence, and the data set is empty.
Dataset open_source(const TransferOptions& options, const std::string& split,
                    std::string* missing = nullptr);

/// Write objects (none named: all) to a split. Returns {"split", "objects", "views"}. Throws a Failure.
Json write_split(const TransferOptions& options, splat_dataset dataset, const std::string& split,
                 const std::vector<std::uint32_t>& objects);

/// Call `copy` for the chosen split, or for each that there is; it returns an object for the report, or null with the
/// reason why there is no such split. Prints the report. Throws a Failure if there is no split at all.
void for_each_split(
    const TransferOptions& options,
    const std::function<Json(const std::string& split, std::string& missing)>& copy);

}  // namespace vkrun

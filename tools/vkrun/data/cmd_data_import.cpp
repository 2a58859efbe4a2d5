// vkrun data import: tables in Parquet files, or folders of images, to a store that trains fast.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "core/os/path.h"
#include "vkrun/cli/command.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/shard.h"
#include "vkrun/data/transfer.h"

namespace vkrun {
namespace {

constexpr const char* kDataImportFooter =
    R"(DIR holds tables in Parquet files, such as those of the published SRN cars with priors:
{intrins,poses,rgbs,depths,normals,segmentation}/{train,val,test}/*.parquet, TABLE/SPLIT-00000-of-00001.parquet as
Hugging Face's, or <name>_<table>.parquet with a column "split". Rows are joined by uuid and frame_id.
OUT/{train,val,test}/ become .npy files with a checksum for each row; 'vkrun train --data OUT' reads them. Without an
import of their own, train, eval and the other commands import tables themselves, into DIR/.splat.

DIR may also be a data set of any other format: SRN's folders (also those of 'vkrun data synth'), photographs with
transforms.json or a COLMAP model, and so on. Its images and maps become the same files, at --size pixels and over
their background. A folder without splits becomes train, or the --split that is given. A repeated command goes on
where a stopped one ended; it is refused if files of DIR have changed since.

--shard 0/4 to 3/4, on machines that share OUT, import a part each; the last to end completes OUT. docs/shards.md
shows them with GNU parallel and as a Slurm array.

Exit status: 0 done, 2 wrong usage, 4 the tables cannot be read, or OUT cannot be written.

Examples:
  vkrun data import srn_cars_priors cars
  vkrun data import srn_cars_priors cars --split train --json
  vkrun data import photographs statues --size 128
)";

struct ImportOptions : TransferOptions {
    bool overwrite = false;
};

/// What a split of the store holds; of a shard only whether it was the last.
Json stored_json(const ImportOptions& options, const std::string& split) {
    const bool complete = std::filesystem::exists(splat::os::path_of(options.out) /
                                                  splat::os::path_of(split) / "store.json");
    if (!complete) return {{"split", split}, {"complete", false}};
    TransferOptions store = options;
    store.source = options.out;
    store.format.clear();
    store.size = 0;
    store.allow_missing = false;
    const Dataset dataset = open_source(store, split);
    const Json report = library_json(splat_dataset_report, dataset.get());
    return {{"split", split},
            {"complete", true},
            {"objects", report.at("objects")},
            {"views", report.at("views")},
            {"resolution", report.at("stored_resolution")},
            {"maps", report.at("maps")}};
}

/// DIR holds Parquet files: DIR/*.parquet or DIR/TABLE/SPLIT/*.parquet.
bool holds_tables(const ImportOptions& options) {
    namespace fs = std::filesystem;
    if (!options.format.empty()) return options.format == "tables";
    constexpr int kDeepest = 2;
    std::error_code failed;
    for (fs::recursive_directory_iterator
             entry(splat::os::path_of(options.source),
                   fs::directory_options::skip_permission_denied, failed),
         end;
         !failed && entry != end; entry.increment(failed)) {
        if (entry->path().extension() == ".parquet") return true;
        if (entry.depth() == kDeepest) entry.disable_recursion_pending();
    }
    return false;  // what cannot be read, opening the data set tells
}

void import_tables(const ImportOptions& options, const std::string& split, std::string& missing) {
    if (options.size != 0 || options.black || options.allow_missing)
        throw Failure(kUsageError,
                      "--size, --black and --allow-missing go with folders: tables are imported as "
                      "they are");
    auto desc = sized<splat_dataset_import_desc>();
    desc.path = options.source.c_str();
    desc.out = options.out.c_str();
    desc.split = split.c_str();
    desc.duckdb = options.duckdb.empty() ? nullptr : options.duckdb.c_str();
    const Shard shard = parse_shard(options.shard);
    desc.shards = shard.count;
    desc.shard = shard.index;
    if (options.overwrite) desc.flags = SPLAT_IMPORT_REPLACE;
    with_progress(split, [&](splat_progress_callback callback, void* user) {
        const splat_result result = splat_dataset_import(&desc, callback, user);
        if (result == SPLAT_ERROR_NOT_FOUND) missing = library_message();
        return result == SPLAT_ERROR_NOT_FOUND ? SPLAT_OK : result;
    });
}

void import_folders(const ImportOptions& options, const std::string& split, std::string& missing) {
    if (options.overwrite)
        throw Failure(kUsageError, "--overwrite is of tables; remove OUT to import folders again");
    if (!options.duckdb.empty())
        throw Failure(kUsageError, "--duckdb goes with tables; folders are imported without it");
    const Dataset dataset = open_source(options, split, &missing);
    if (missing.empty()) write_split(options, dataset.get(), split, {});
}

Json import_split(const ImportOptions& options, const std::string& split, std::string& missing) {
    holds_tables(options) ? import_tables(options, split, missing)
                          : import_folders(options, split, missing);
    return missing.empty() ? stored_json(options, split) : Json(nullptr);
}

}  // namespace

void add_data_import(CLI::App& data, int& exit_code) {
    CLI::App* command =
        add_command(data, "import", "Import tables or folders for training.", kDataImportFooter);
    const auto options = std::make_shared<ImportOptions>();
    add_transfer_options(*command, *options);
    add_split_option(*command, *options);
    options->layout = "store";
    add_source_options(*command, *options);
    add_shard_option(*command, options->shard, "the rows of tables, or of the objects of folders");
    add_overwrite_flag(*command, options->overwrite, "an import of other tables");
    command->callback([options, &exit_code] {
        std::error_code none;
        if (std::filesystem::equivalent(splat::os::path_of(options->source),
                                        splat::os::path_of(options->out), none))
            throw Failure(kUsageError,
                          "OUT is the folder that is imported; name another, or an empty one");
        for_each_split(*options, [&](const std::string& split, std::string& missing) {
            return import_split(*options, split, missing);
        });
        exit_code = kSuccess;
    });
}

}  // namespace vkrun

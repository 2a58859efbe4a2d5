// vkrun data import: tables in Parquet files to a store that trains fast.

#include <CLI/CLI.hpp>
#include <memory>

#include "vkrun/cli/command.h"
#include "vkrun/cli/options.h"
#include "vkrun/data/transfer.h"

namespace vkrun {
namespace {

constexpr const char* kDataImportFooter =
    R"(DIR holds tables in Parquet files, such as those of the published SRN cars with priors:
{intrins,poses,rgbs,depths,normals,segmentation}/{train,val,test}/*.parquet, or <name>_<table>.parquet with a column
"split". Rows are joined by uuid and frame_id. OUT/{train,val,test}/ become .npy files with a checksum for each row;
'vkrun train --data OUT' reads them. Without an import of their own, train, eval and the other commands import
tables themselves, into DIR/.splat. A repeated command goes on where a stopped one ended.

Exit status: 0 done, 2 wrong usage, 4 the tables cannot be read, or OUT cannot be written.

Examples:
  vkrun data import srn_cars_priors cars
  vkrun data import srn_cars_priors cars --split train --json
)";

struct ImportOptions : TransferOptions {
    bool overwrite = false;
};

Json import_split(const ImportOptions& options, const std::string& split, std::string& missing) {
    auto desc = sized<splat_dataset_import_desc>();
    desc.path = options.source.c_str();
    desc.out = options.out.c_str();
    desc.split = split.c_str();
    desc.duckdb = options.duckdb.empty() ? nullptr : options.duckdb.c_str();
    if (options.overwrite) desc.flags = SPLAT_IMPORT_REPLACE;
    splat_result result = SPLAT_OK;
    with_progress(split, [&](splat_progress_callback callback, void* user) {
        result = splat_dataset_import(&desc, callback, user);
        if (result == SPLAT_ERROR_NOT_FOUND) missing = splat_last_error_message();
        return result == SPLAT_ERROR_NOT_FOUND ? SPLAT_OK : result;
    });
    if (!missing.empty()) return nullptr;
    TransferOptions store = options;
    store.source = options.out;
    const Dataset dataset = open_source(store, split);
    const Json report = library_json(splat_dataset_report, dataset.get());
    return {{"split", split},
            {"objects", report.at("objects")},
            {"views", report.at("views")},
            {"resolution", report.at("stored_resolution")},
            {"maps", report.at("maps")}};
}

}  // namespace

void add_data_import(CLI::App& data, int& exit_code) {
    CLI::App* command = add_command(data, "import", "Import tables in Parquet files for training.",
                                    kDataImportFooter);
    const auto options = std::make_shared<ImportOptions>();
    add_transfer_options(*command, *options);
    add_split_option(*command, *options);
    add_overwrite_flag(*command, options->overwrite, "an import of other tables");
    command->callback([options, &exit_code] {
        for_each_split(*options, [&](const std::string& split, std::string& missing) {
            return import_split(*options, split, missing);
        });
        exit_code = kSuccess;
    });
}

}  // namespace vkrun

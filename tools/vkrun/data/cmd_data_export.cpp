// vkrun data export: a data set in another layout.

#include <CLI/CLI.hpp>
#include <memory>

#include "vkrun/cli/command.h"
#include "vkrun/cli/options.h"
#include "vkrun/data/transfer.h"

namespace vkrun {
namespace {

constexpr const char* kDataExportFooter =
    R"(DIR is a data set of any format: tables, SRN's folders (also those of 'vkrun data synth'), photographs with
cameras, and others. LAYOUT is
  tables  Parquet files in the schema of the published SRN cars with priors, with a README.md for Hugging Face
  srn     srn_CLASS/CLASS_{train,val,test}/ with intrinsics.txt, pose/, rgb/ and the maps that there are
  images  {train,val,test}/OBJECT/ with transforms.json, the images in rgb/, and the maps that there are
  store   .npy files as 'vkrun data import' writes them
Text of cameras, images and maps go from one to the other unchanged. OUT/export_{train,val,test}.json say what OUT
holds, with a checksum of each table. A folder without splits becomes train, or the --split that is given. A repeated
command goes on where a stopped one ended; it is refused if files of DIR have changed since.

Exit status: 0 done, 2 wrong usage, 4 the data cannot be read, or OUT cannot be written.

Examples:
  vkrun data export data tables
  vkrun data export srn_cars_priors data --to srn --split test
  vkrun data export photographs tables --size 128 --class statues --json
)";

}  // namespace

void add_data_export(CLI::App& data, int& exit_code) {
    CLI::App* command =
        add_command(data, "export", "Write a data set as tables or folders.", kDataExportFooter);
    const auto options = std::make_shared<TransferOptions>();
    add_transfer_options(*command, *options);
    add_split_option(*command, *options);
    add_export_options(*command, *options);
    command->callback([command, options, &exit_code] {
        check_effect(*command, *options);
        for_each_split(*options, [&](const std::string& split, std::string& missing) -> Json {
            const Dataset dataset = open_source(*options, split, &missing);
            if (!missing.empty()) return nullptr;
            return write_split(*options, dataset.get(), split, {});
        });
        exit_code = kSuccess;
    });
}

}  // namespace vkrun

// vkrun report: one page about training runs.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "core/os/path.h"
#include "vkrun/cli/command.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/train/run_report.h"

namespace vkrun {
namespace {

constexpr const char* kReportFooter =
    R"(The page shows each run's facts, its curves of loss and validation PSNR, and its latest renders (input, then
truth, prediction and error alternately), and turns its validation object (renders/best.ply); several runs share
one chart. Runs with an evaluation in eval/ are compared with the first of them over the same objects. The page loads
nothing from elsewhere.

Exit status: 0 done, 1 the page cannot be written, 2 wrong usage, 4 a folder holds no run.

Examples:
  vkrun report runs/a
  vkrun report runs/a runs/b --out compare.html --json
)";

struct ReportOptions {
    std::vector<std::string> runs;
    std::string out;
    bool json = false;
};

/// A file that is there and no page is not replaced.
void check_page(const std::string& path) {
    std::error_code none;
    if (path.empty() || !std::filesystem::exists(splat::os::path_of(path), none)) return;
    std::string first(15, '\0');
    std::ifstream file = open_to_read(path);
    file.read(first.data(), static_cast<std::streamsize>(first.size()));
    if (first != "<!DOCTYPE html>")
        throw Failure(kUsageError, "--out '" + path + "' is there and is no page; name another");
}

int report(const ReportOptions& options) {
    const std::string out = options.out.empty() ? "" : one_file(options.out, "report.html");
    check_page(out);
    make_folder_of(out);
    const std::string path = write_run_report(options.runs, out);
    if (options.json)
        print_json({{"report", path}, {"runs", options.runs.size()}});
    else
        std::printf("%s\n", path.c_str());
    return kSuccess;
}

}  // namespace

void add_report(CLI::App& app, int& exit_code) {
    CLI::App* command =
        add_command(app, "report", "Write a page about training runs.", kReportFooter);
    auto options = std::make_shared<ReportOptions>();
    command->add_option("RUN", options->runs, "Folders of runs")->required()->type_name("");
    command
        ->add_option("--out", options->out,
                     "Page to write, or a folder for report.html; default: the\nfirst RUN")
        ->type_name("FILE");
    add_json_flag(*command, options->json);
    command->callback([options, &exit_code] { exit_code = report(*options); });
}

}  // namespace vkrun

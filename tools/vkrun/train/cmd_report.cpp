// vkrun report: one page about training runs.

#include <CLI/CLI.hpp>
#include <memory>

#include "vkrun/command.h"
#include "vkrun/device_text.h"
#include "vkrun/train/run_report.h"

namespace vkrun {
namespace {

constexpr const char* kReportFooter =
    R"(The page holds each run's facts, its curves of loss and validation PSNR, and its latest renders (input,
then truth, prediction and error in turns); several runs share one chart. Runs with an evaluation in eval/
are compared with the first of them over the same objects. The page loads nothing from elsewhere. Without
--out it is report.html in the first run's folder, where training leaves one.

Exit status: 0 written, 1 it cannot be, 2 wrong usage, 4 a folder holds no run.

Examples:
  vkrun report runs/a
  vkrun report runs/a runs/b --out compare.html --json
)";

struct ReportOptions {
    std::vector<std::string> runs;
    std::string out;
    bool json = false;
};

int report(const ReportOptions& options) {
    const std::string path = write_run_report(options.runs, options.out);
    if (options.json)
        std::printf("%s\n", json_text({{"report", path}, {"runs", options.runs.size()}}).c_str());
    else
        std::printf("%s\n", path.c_str());
    return kSuccess;
}

}  // namespace

void add_report(CLI::App& app, int& exit_code) {
    CLI::App* command = app.add_subcommand("report", "Write a page about training runs");
    auto options = std::make_shared<ReportOptions>();
    command->add_option("RUN", options->runs, "Folders of runs")->required();
    command->add_option("--out", options->out, "The page; report.html in the first folder");
    command->add_flag("--json", options->json, "JSON on standard output");
    command->footer(kReportFooter);
    command->callback([options, &exit_code] { exit_code = report(*options); });
}

}  // namespace vkrun

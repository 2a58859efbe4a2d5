// vkrun report: one page about training runs.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>

#include "vkrun/command.h"
#include "vkrun/train/html_page.h"
#include "vkrun/train/run_folder.h"

namespace vkrun {
namespace {

constexpr const char* kReportFooter =
    R"(The page holds each run's facts, its curves of loss and validation PSNR, and its latest renders (input,
then truth and prediction in pairs); several runs share one chart. It loads nothing from elsewhere. Without
--out it is report.html in the first run's folder.

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

struct Run {
    std::string folder;
    Json facts;
    std::vector<Json> metrics;
};

Run read_run(const std::string& folder) {
    std::ifstream file(std::filesystem::path(folder) / "run.json");
    Run run{folder, Json::parse(file, nullptr, false), RunFolder::metrics(folder)};
    if (!run.facts.is_object())
        throw Failure(kBadData, "'" + folder + "' holds no run (no run.json that can be read)");
    return run;
}

HtmlPage::Curve curve_of(const Run& run, const char* key) {
    HtmlPage::Curve curve{run.folder, {}};
    for (const Json& line : run.metrics)
        if (line.contains(key) && line.at(key).is_number())
            curve.points.emplace_back(line.at("step").get<double>(), line.at(key).get<double>());
    return curve;
}

std::string latest_render(const Run& run) {
    std::string latest;
    std::error_code none;
    for (const auto& entry :
         std::filesystem::directory_iterator(std::filesystem::path(run.folder) / "renders", none))
        latest = std::max(latest, entry.path().string());
    return latest;
}

void add_run(HtmlPage& page, const Run& run) {
    page.heading(run.folder);
    std::vector<std::pair<std::string, std::string>> rows;
    for (const auto& [key, value] : run.facts.items())
        if (!value.is_object())
            rows.emplace_back(key, value.is_string()         ? value.get<std::string>()
                                   : value.is_number_float() ? format("%.6g", value.get<double>())
                                                             : value.dump());
    if (run.facts.contains("device"))
        rows.emplace_back("device", run.facts.at("device").value("name", ""));
    if (run.facts.contains("data")) {
        const Json& data = run.facts.at("data");
        rows.emplace_back("data",
                          format("%s, %u objects with %u views, trained on at %u pixels",
                                 data.value("format", "").c_str(), data.value("objects", 0U),
                                 data.value("views", 0U), data.value("resolution", 0U)));
    }
    page.facts(rows);
    page.picture(latest_render(run),
                 "validation objects: input, then truth and prediction in pairs", 1000);
}

int report(const ReportOptions& options) {
    std::vector<Run> runs;
    for (const std::string& folder : options.runs) runs.push_back(read_run(folder));
    HtmlPage page(runs.size() == 1 ? "Training " + runs[0].folder : "Training runs");
    const std::pair<const char*, const char*> charts[] = {
        {"val_psnr", "PSNR of novel views of validation objects, dB, by step"},
        {"loss", "training loss by step"},
        {"psnr", "PSNR of training targets, dB, by step"}};
    for (const auto& [key, caption] : charts) {
        std::vector<HtmlPage::Curve> curves;
        for (const Run& run : runs) curves.push_back(curve_of(run, key));
        page.chart(caption, curves);
    }
    for (const Run& run : runs) add_run(page, run);
    const std::string path = options.out.empty() ? runs[0].folder + "/report.html" : options.out;
    write_file(path, page.text());
    if (options.json)
        std::printf("%s\n", json_text({{"report", path}, {"runs", runs.size()}}).c_str());
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

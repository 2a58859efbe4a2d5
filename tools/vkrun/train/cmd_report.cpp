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
#include "vkrun/train/run_evaluations.h"
#include "vkrun/train/run_report.h"

namespace vkrun {
namespace {

constexpr const char* kReportFooter =
    R"(The page shows each run's facts, its curves of loss and validation PSNR, and its latest renders (input, then
truth, prediction and error alternately), and turns its validation object (renders/best.ply); several runs share
one chart. Each figure has a link that saves it as SVG. The page loads nothing from elsewhere.
Runs with an evaluation in eval/ are compared with the first of them over the same objects: permutation test, percentile
and BCa bootstrap intervals, Wilcoxon's signed rank test, wins by object and image, as 'vkrun compare --help' says.
--latex writes them as a table (which needs no package), --csv all numbers; both name the tests and intervals.

Exit status: 0 done, 1 the page cannot be written, 2 wrong usage, 4 a folder holds no run.

Examples:
  vkrun report runs/a
  vkrun report runs/a runs/b --out compare.html --json
  vkrun report runs/a runs/b runs/c --latex table.tex --csv table.csv
)";

struct ReportOptions {
    std::vector<std::string> runs;
    std::string out, latex, csv;
    bool overwrite = false, json = false;
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

/// Throws a Failure unless there are evaluations for the tables that are asked for, and these can be written.
RunEvaluations evaluations_of(const ReportOptions& options, const std::string& page) {
    if (options.latex.empty() && options.csv.empty()) {
        if (options.overwrite)
            throw Failure(kUsageError,
                          "--overwrite is for the files of --latex and --csv, of which none is "
                          "asked for");
        return {};
    }
    if (options.latex == options.csv)
        throw Failure(kUsageError, "'" + options.csv + "' is asked for twice; name two files");
    std::vector<std::string> inputs;
    for (const std::string& run : options.runs)
        for (const char* const name : {"per_object.csv", "per_image.csv", "objects.json"})
            inputs.push_back(splat::os::text_of(splat::os::path_of(run) / "eval" / name));
    const auto whole = [](const std::string& path) {
        std::error_code failed;
        return std::filesystem::weakly_canonical(splat::os::path_of(path), failed);
    };
    for (const std::string& file : {options.latex, options.csv}) {
        if (file.empty()) continue;
        if (whole(file) == whole(page))
            throw Failure(kUsageError, "'" + file + "' is the page of --out; name another file");
        check_target(file, options.overwrite, inputs);
        check_folder_of(file);
    }
    RunEvaluations found = compare_evaluations(options.runs);
    if (found.table.rows.empty())
        throw Failure(kBadData,
                      "--latex and --csv compare evaluations, and fewer than two of the runs have "
                      "one over the same objects; make them by 'vkrun eval ... --out RUN/eval'");
    return found;
}

int report(const ReportOptions& options) {
    const std::string out = options.out.empty() ? "" : one_file(options.out, "report.html");
    check_page(out);
    const std::string page =
        out.empty() ? splat::os::text_of(splat::os::path_of(options.runs[0]) / "report.html") : out;
    const RunEvaluations evaluations = evaluations_of(options, page);
    make_folder_of(out);
    const bool tables = !options.latex.empty() || !options.csv.empty();
    const std::string path =
        write_run_report(options.runs, out, false, tables ? &evaluations : nullptr);
    if (!options.latex.empty()) write_text(options.latex, comparison_latex(evaluations.table));
    if (!options.csv.empty()) write_text(options.csv, comparison_csv(evaluations.table));
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
    command->add_option("--latex", options->latex, "Table of the evaluations, .tex")
        ->type_name("FILE");
    command->add_option("--csv", options->csv, "All numbers of their comparison, .csv")
        ->type_name("FILE");
    add_overwrite_flag(*command, options->overwrite, "the files of --latex and --csv");
    add_json_flag(*command, options->json);
    command->callback([options, &exit_code] { exit_code = report(*options); });
}

}  // namespace vkrun

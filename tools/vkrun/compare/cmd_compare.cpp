// vkrun compare: is one evaluation better than another? Needs no device.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>

#include "core/os/path.h"
#include "vkrun/cli/command.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/table.h"
#include "vkrun/cli/text.h"
#include "vkrun/compare/comparison_tables.h"
#include "vkrun/compare/distribution_plot.h"

namespace vkrun {
namespace {

constexpr const char* kCompareFooter =
    R"(A and B are results of 'vkrun eval' (a folder, results.json or per_object.csv) or scores.txt of Splatter Image.
Objects are paired by name. For each metric the mean difference B - A comes with a permutation test (signs of the
differences flipped), Student's t test, and Cohen's d of the differences; with two bootstrap intervals of 95 %, by
percentiles and bias-corrected and accelerated (BCa, Efron 1987); and with Wilcoxon's signed rank test: differences
that are 0 are dropped (Wilcoxon's rule), p is exact for up to 50 differences, else of a normal
distribution whose variance is corrected for ties. p (Holm) is p corrected for the number of metrics; if that of the
permutation test is below 0.05, the difference is called better or worse. The objects, and where per_image.csv lies
beside both per_object.csv the images, in which A is better, both are equal, and B is better, are counted.
Where only A or only B has a finite score of an object, the others do not tell which is better: not comparable.
So few objects that no difference would be shown, however clear, are too few: with n pairs p is 2^(1-n) or more by
either test, so that one metric takes 6 objects, two and three take 7. Scores of other views, by the numbers in
per_object.csv and the options in objects.json beside it, are refused.

--latex writes a table (which needs no package), --csv all numbers; both name the tests and intervals.

--unpaired ignores which object a score belongs to, as the published code does: a permutation of all scores, and
means drawn from a normal distribution like A. If A and B cover different objects, the difference may come from the
objects alone, and nothing is called better or worse.

Exit status: 0 nothing is worse, 1 a file cannot be written, 2 wrong usage, 4 files that are damaged, share no
objects or are of other views, 6 B is worse in some metric.

Examples:
  vkrun compare runs/base/eval runs/new/eval
  vkrun compare reference/scores.txt both/scores.txt --unpaired --json
  vkrun compare a.csv b.csv --plot differences.svg --latex table.tex --csv table.csv
)";

struct CompareOptions {
    std::string a;
    std::string b;
    std::string plot, latex, csv;
    bool unpaired = false;
    bool overwrite = false;
    bool json = false;
    std::uint64_t seed = 0;
    std::uint32_t permutations = 300000;
};

/// The comparison of two files in one metric.
struct MetricFinding : ComparedMetric {
    std::vector<double> a, b;
};

/// A library call that blames the files for its errors.
void check_files(splat_result result) {
    if (result < SPLAT_OK) throw Failure(kBadData, library_message());
}

Comparison compare_files(const CompareOptions& options) {
    auto desc = sized<splat_compare_desc>();
    if (options.unpaired) desc.flags = SPLAT_COMPARE_UNPAIRED;
    desc.a.path = options.a.c_str();
    desc.b.path = options.b.c_str();
    desc.seed = options.seed;
    desc.resamples = options.permutations;
    Comparison comparison;
    check_files(splat_compare_scores(&desc, comparison.out()));
    return comparison;
}

std::vector<MetricFinding> findings_of(const Comparison& comparison, const Json& report) {
    std::vector<MetricFinding> findings;
    for (ComparedMetric& compared : compared_metrics(comparison.get(), report)) {
        MetricFinding finding{std::move(compared), {}, {}};
        const auto index = static_cast<std::uint32_t>(findings.size());
        finding.a.resize(finding.found.n_a);
        finding.b.resize(finding.found.n_b);
        check(splat_comparison_samples(comparison.get(), index, finding.a.data(), finding.a.size(),
                                       finding.b.data(), finding.b.size()));
        findings.push_back(std::move(finding));
    }
    return findings;
}

/// "better", "too few objects (3; at least 7)"
std::string verdict_text(const MetricFinding& finding, std::size_t least) {
    if (finding.found.verdict != SPLAT_VERDICT_TOO_FEW) return finding.verdict;
    return format("%s (%llu; at least %zu)", finding.verdict.c_str(),
                  static_cast<unsigned long long>(std::min(finding.found.n_a, finding.found.n_b)),
                  least);
}

void print_table(const Json& report, const CompareOptions& options,
                 const std::vector<MetricFinding>& findings) {
    const auto text = [&report](const char* key) { return report.at(key).get<std::string>(); };
    const auto count = [&report](const char* key) { return report.at(key).get<std::size_t>(); };
    std::printf("A: %s, %zu objects\nB: %s, %zu objects; %zu of them in both; %s\n",
                text("a").c_str(), count("objects_a"), text("b").c_str(), count("objects_b"),
                count("shared_objects"), options.unpaired ? "not paired" : "paired by their names");
    Table table({"metric", ">n", ">A", ">B", ">B - A", ">95 % interval", ">p", ">p (Holm)",
                 options.unpaired ? ">p (normal)" : ">p (t)", ">d", "verdict"});
    for (const MetricFinding& finding : findings) {
        const splat_metric_comparison& f = finding.found;
        const auto n_a = std::to_string(f.n_a), n_b = std::to_string(f.n_b);
        table.add({finding.metric, n_a == n_b ? n_a : n_a + ", " + n_b, format("%.5f", f.mean_a),
                   format("%.5f", f.mean_b), format("%+.5f", f.difference),
                   format("%+.5f to %+.5f", f.low, f.high), format("%.3g", f.p_permutation),
                   format("%.3g", f.p_holm), format("%.3g", f.p_parametric),
                   format("%+.3f", f.effect), verdict_text(finding, count("least_objects"))});
    }
    Table more({"metric", ">95 % BCa interval", ">W", ">of", ">p (Wilcoxon)", ">p (Holm)", "test",
                ">objects A : tie : B", ">images A : tie : B"});
    for (const MetricFinding& finding : findings) {
        const splat_metric_comparison& f = finding.found;
        more.add({finding.metric, interval_text("%+.5f", f.bca_low, f.bca_high),
                  options.unpaired ? "-" : format("%g", f.wilcoxon_w),
                  options.unpaired ? "-" : std::to_string(f.wilcoxon_n),
                  options.unpaired ? "-" : format("%.3g", f.p_wilcoxon),
                  options.unpaired ? "-" : format("%.3g", f.p_wilcoxon_holm), rank_test_name(f),
                  wins_text(f.wins_a, f.ties, f.wins_b),
                  wins_text(f.image_wins_a, f.image_ties, f.image_wins_b)});
    }
    std::printf("%s\n%s", table.text().c_str(), more.text().c_str());
}

void write_tables(const CompareOptions& options, const std::vector<MetricFinding>& findings,
                  const Json& report) {
    ComparisonTable table;
    table.baseline = options.a;
    table.add(options.b, {findings.begin(), findings.end()}, report);
    write_text(options.latex, comparison_latex(table));
    write_text(options.csv, comparison_csv(table));
}

/// Throws a Failure unless each file that is asked for can be written.
void check_outputs(const CompareOptions& options) {
    std::vector<std::string> inputs = {options.a, options.b}, taken;
    for (const std::string& given : {options.a, options.b})
        for (const std::string& folder :
             {given, splat::os::text_of(splat::os::path_of(given).parent_path())})
            for (const char* const name : {"per_object.csv", "per_image.csv"})
                inputs.push_back(splat::os::text_of(splat::os::path_of(folder) / name));
    for (const std::string& file : {options.plot, options.latex, options.csv}) {
        if (file.empty()) continue;
        check_target(file, options.overwrite, inputs);
        check_folder_of(file);
        if (std::count(taken.begin(), taken.end(), file) != 0)
            throw Failure(kUsageError, "'" + file + "' is asked for twice; name two files");
        taken.push_back(file);
    }
    if (taken.empty() && options.overwrite)
        throw Failure(kUsageError,
                      "--overwrite is for the files of --plot, --latex and --csv, of which none is "
                      "asked for");
}

void write_plot(const CompareOptions& options, const std::vector<MetricFinding>& findings) {
    std::vector<PlotPanel> panels;
    for (const MetricFinding& finding : findings) {
        const splat_metric_comparison& f = finding.found;
        if (options.unpaired) {
            panels.push_back(
                {finding.metric + " of A", finding.a, f.mean_a, f.mean_a, f.mean_a, f.mean_a});
            panels.push_back({finding.metric + " of B", finding.b, f.mean_a, f.mean_b,
                              f.mean_a + f.low, f.mean_a + f.high});
            continue;
        }
        PlotPanel panel{format("%s: B - A of %zu objects, p = %.3g", finding.metric.c_str(),
                               finding.a.size(), f.p_permutation),
                        {},
                        0,
                        f.difference,
                        f.low,
                        f.high};
        for (std::size_t i = 0; i < finding.a.size(); ++i)
            panel.values.push_back(finding.b[i] - finding.a[i]);
        panels.push_back(std::move(panel));
    }
    write_text(options.plot, distribution_svg("B: " + options.b + ", A: " + options.a, panels));
}

int compare(const CompareOptions& options) {
    check_outputs(options);
    const Comparison comparison = compare_files(options);
    Json report = library_json(splat_comparison_report, comparison.get());
    auto info = sized<splat_comparison_info>();
    check(splat_comparison_get_info(comparison.get(), &info));
    if (info.comparable == 0 && info.shared_objects > 0)
        report["note"] =
            "A and B do not cover the same objects: their difference may come from the objects "
            "alone; "
            "without --unpaired the objects in both are compared";
    const std::vector<MetricFinding> findings = findings_of(comparison, report);
    if (!options.plot.empty()) write_plot(options, findings);
    write_tables(options, findings, report);
    if (options.json)
        print_json(report);
    else
        print_table(report, options, findings);
    const auto note = report.at("note").get<std::string>();
    if (!note.empty()) std::fprintf(stderr, "note: %s\n", note.c_str());
    const bool worse = std::any_of(findings.begin(), findings.end(), [](const MetricFinding& f) {
        return f.found.verdict == SPLAT_VERDICT_WORSE;
    });
    return worse ? kGateMissed : kSuccess;
}

}  // namespace

void add_compare(CLI::App& app, int& exit_code) {
    CLI::App* command = add_command(
        app, "compare", "Test whether one evaluation is better than another.", kCompareFooter);
    const auto options = std::make_shared<CompareOptions>();
    command->add_option("A", options->a, "Scores of the baseline")->required()->type_name("");
    command->add_option("B", options->b, "Scores to compare with the baseline")
        ->required()
        ->type_name("");
    command->add_flag("--unpaired", options->unpaired, "Ignore which object a score belongs to");
    command->add_option("--resamples", options->permutations, "Number of random permutations")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(100, 100000000).description(""));
    command->add_option("--seed", options->seed, "Seed of all random choices")
        ->type_name("N")
        ->check(CLI::NonNegativeNumber.description(""))
        ->capture_default_str();
    command->add_option("--plot", options->plot, "Plot of the distributions, .svg")
        ->type_name("FILE");
    command->add_option("--latex", options->latex, "Table with intervals and tests, .tex")
        ->type_name("FILE");
    command->add_option("--csv", options->csv, "All numbers, with the tests' names, .csv")
        ->type_name("FILE");
    add_overwrite_flag(*command, options->overwrite, "FILE");
    add_json_flag(*command, options->json);
    command->callback([options, &exit_code] { exit_code = compare(*options); });
}

}  // namespace vkrun

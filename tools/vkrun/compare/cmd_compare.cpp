// vkrun compare: is one evaluation better than another? Needs no device.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>

#include "vkrun/cli/command.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/table.h"
#include "vkrun/cli/text.h"
#include "vkrun/compare/distribution_plot.h"
#include "vkrun/compare/score_file.h"
#include "vkrun/compare/significance.h"

namespace vkrun {
namespace {

constexpr double kLevel = 0.05;

constexpr const char* kCompareFooter =
    R"(A and B are results of 'vkrun eval' (a folder, results.json or per_object.csv) or scores.txt of Splatter Image.
Objects are paired by name. For each metric the mean difference B - A comes with a permutation test (signs of the
differences flipped), Student's t test, a bootstrap interval of 95 % and Cohen's d. p_holm is p_permutation
corrected for the number of metrics; below 0.05 the difference is called better or worse.

--unpaired ignores which object a score belongs to, as the published code does: a permutation of all scores, and
means drawn from a normal distribution like A. If A and B cover different objects, the difference may come from the
objects alone, and nothing is called better or worse.

Exit status: 0 nothing is worse, 1 a file cannot be written, 2 wrong usage, 4 files that are damaged or share no
objects, 6 B is worse in some metric.

Examples:
  vkrun compare runs/base/eval runs/new/eval
  vkrun compare reference/scores.txt both/scores.txt --unpaired --json
  vkrun compare a.csv b.csv --plot differences.svg
)";

struct CompareOptions {
    std::string a;
    std::string b;
    std::string plot;
    bool unpaired = false;
    bool overwrite = false;
    bool json = false;
    ResampleOptions resample;
};

struct MetricFinding {
    MetricSamples samples;
    Comparison comparison;
    double p_holm = 1;
    std::string verdict;
};

std::size_t shared_objects(const ScoreFile& a, const ScoreFile& b) {
    std::size_t most = 0;
    for (const std::string& metric : a.metrics) {
        if (b.values.count(metric) == 0) continue;
        std::size_t count = 0;
        for (const auto& [name, value] : a.values.at(metric))
            count += b.values.at(metric).count(name);
        most = std::max(most, count);
    }
    return most;
}

std::string verdict_of(const MetricFinding& finding, bool comparable) {
    if (!comparable) return "not comparable";
    if (!(finding.p_holm < kLevel)) return "no difference shown";
    const bool higher = finding.comparison.difference > 0;
    return higher != (finding.samples.metric == "lpips") ? "better" : "worse";
}

std::vector<MetricFinding> find(const ScoreFile& a, const ScoreFile& b,
                                const CompareOptions& options, bool comparable) {
    std::vector<MetricFinding> findings;
    std::vector<double> p;
    for (MetricSamples& samples : samples_of(a, b, options.unpaired)) {
        MetricFinding finding;
        finding.comparison = options.unpaired
                                 ? compare_pooled(samples.a, samples.b, options.resample)
                                 : compare_paired(samples.a, samples.b, options.resample);
        finding.samples = std::move(samples);
        p.push_back(finding.comparison.p_permutation);
        findings.push_back(std::move(finding));
    }
    const std::vector<double> adjusted = holm(p);
    for (std::size_t i = 0; i < findings.size(); ++i) {
        findings[i].p_holm = adjusted[i];
        findings[i].verdict = verdict_of(findings[i], comparable);
    }
    return findings;
}

Json json_of(const ScoreFile& a, const ScoreFile& b, std::size_t shared,
             const CompareOptions& options, const std::vector<MetricFinding>& findings,
             const std::string& note) {
    Json metrics = Json::array();
    for (const MetricFinding& f : findings)
        metrics.push_back({{"metric", f.samples.metric},
                           {"mean_a", mean(f.samples.a)},
                           {"mean_b", mean(f.samples.b)},
                           {"observed_difference", f.comparison.difference},
                           {"p_permutation", f.comparison.p_permutation},
                           {"p_parametric", f.comparison.p_parametric},
                           {"p_holm", f.p_holm},
                           {"ci", {f.comparison.low, f.comparison.high}},
                           {"effect_size", f.comparison.effect},
                           {"n_pairs", options.unpaired ? 0 : f.samples.a.size()},
                           {"n_a", f.samples.a.size()},
                           {"n_b", f.samples.b.size()},
                           {"exact", f.comparison.exact},
                           {"verdict", f.verdict}});
    return {{"a", a.path},
            {"b", b.path},
            {"paired", !options.unpaired},
            {"objects_a", a.objects},
            {"objects_b", b.objects},
            {"shared_objects", shared},
            {"seed", options.resample.seed},
            {"permutations", options.resample.permutations},
            {"note", note},
            {"metrics", metrics}};
}

void print_table(const ScoreFile& a, const ScoreFile& b, std::size_t shared,
                 const CompareOptions& options, const std::vector<MetricFinding>& findings) {
    std::printf("A: %s, %zu objects\nB: %s, %zu objects; %zu of them in both; %s\n", a.path.c_str(),
                a.objects, b.path.c_str(), b.objects, shared,
                options.unpaired ? "not paired" : "paired by their names");
    Table table({"metric", ">A", ">B", ">B - A", ">95 % interval", ">p", ">p (Holm)",
                 options.unpaired ? ">p (normal)" : ">p (t)", ">d", "verdict"});
    for (const MetricFinding& f : findings)
        table.add({f.samples.metric, format("%.5f", mean(f.samples.a)),
                   format("%.5f", mean(f.samples.b)), format("%+.5f", f.comparison.difference),
                   format("%+.5f to %+.5f", f.comparison.low, f.comparison.high),
                   format("%.3g", f.comparison.p_permutation), format("%.3g", f.p_holm),
                   format("%.3g", f.comparison.p_parametric), format("%+.3f", f.comparison.effect),
                   f.verdict});
    std::printf("%s", table.text().c_str());
}

void write_plot(const CompareOptions& options, const std::vector<MetricFinding>& findings) {
    std::vector<PlotPanel> panels;
    for (const MetricFinding& f : findings) {
        const Comparison& c = f.comparison;
        if (options.unpaired) {
            panels.push_back({f.samples.metric + " of A", f.samples.a, mean(f.samples.a),
                              mean(f.samples.a), mean(f.samples.a), mean(f.samples.a)});
            panels.push_back({f.samples.metric + " of B", f.samples.b, mean(f.samples.a),
                              mean(f.samples.b), mean(f.samples.a) + c.low,
                              mean(f.samples.a) + c.high});
            continue;
        }
        PlotPanel panel{format("%s: B - A of %zu objects, p = %.3g", f.samples.metric.c_str(),
                               f.samples.a.size(), c.p_permutation),
                        {},
                        0,
                        c.difference,
                        c.low,
                        c.high};
        for (std::size_t i = 0; i < f.samples.a.size(); ++i)
            panel.values.push_back(f.samples.b[i] - f.samples.a[i]);
        panels.push_back(std::move(panel));
    }
    write_text(options.plot, distribution_svg("B: " + options.b + ", A: " + options.a, panels));
}

int compare(const CompareOptions& options) {
    if (!options.plot.empty()) check_target(options.plot, options.overwrite);
    const ScoreFile a = read_scores(options.a);
    const ScoreFile b = read_scores(options.b);
    const std::size_t shared = shared_objects(a, b);
    const std::string apart =
        "A and B share no object: their difference may come from the objects alone, whatever a "
        "test says";
    if (shared == 0 && !options.unpaired)
        throw Failure(
            kBadData,
            apart + ". Evaluate both on the same split, or pass --unpaired for the numbers");
    // Unpaired scores cover the same objects only if both files have all of them.
    const bool comparable =
        shared != 0 && (!options.unpaired || (shared == a.objects && shared == b.objects));
    std::string note;
    if (shared == 0)
        note = apart;
    else if (!comparable)
        note =
            "A and B do not cover the same objects: their difference may come from the objects "
            "alone; "
            "without --unpaired the objects in both are compared";
    else if (shared < std::max(a.objects, b.objects))
        note = format("%zu objects of A and %zu of B are in one file only and are left out",
                      a.objects - shared, b.objects - shared);
    const std::vector<MetricFinding> findings = find(a, b, options, comparable);
    if (!options.plot.empty()) write_plot(options, findings);
    if (options.json)
        print_json(json_of(a, b, shared, options, findings, note));
    else
        print_table(a, b, shared, options, findings);
    if (!note.empty()) std::fprintf(stderr, "note: %s\n", note.c_str());
    const bool worse = std::any_of(findings.begin(), findings.end(),
                                   [](const MetricFinding& f) { return f.verdict == "worse"; });
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
    command
        ->add_option("--resamples", options->resample.permutations, "Number of random permutations")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(100, 100000000).description(""));
    command->add_option("--seed", options->resample.seed, "Seed of all random choices")
        ->type_name("N")
        ->capture_default_str();
    command->add_option("--plot", options->plot, "Plot of the distributions, .svg")
        ->type_name("FILE");
    add_overwrite_flag(*command, options->overwrite, "FILE");
    add_json_flag(*command, options->json);
    command->callback([options, &exit_code] { exit_code = compare(*options); });
}

}  // namespace vkrun

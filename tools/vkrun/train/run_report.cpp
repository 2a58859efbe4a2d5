#include "vkrun/train/run_report.h"

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <fstream>

#include "core/os/file.h"
#include "core/os/path.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/html_page.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/text.h"
#include "vkrun/fit/fit_report.h"
#include "vkrun/train/run_evaluations.h"
#include "vkrun/train/run_scene.h"

namespace vkrun {
namespace {

namespace os = splat::os;

struct ShownRun {
    std::string folder;
    Json facts;
    std::vector<Json> metrics;

    /// A fit of photographs, not a training.
    [[nodiscard]] bool is_fit() const { return facts.contains("photographs"); }
};

/// The lines of metrics.jsonl that can be read.
std::vector<Json> read_metrics(const std::filesystem::path& folder) {
    std::vector<Json> lines;
    std::ifstream file = open_to_read(folder / "metrics.jsonl");
    for (std::string line; std::getline(file, line);) {
        Json json = Json::parse(line, nullptr, false);
        if (json.is_object() && json.contains("step")) lines.push_back(std::move(json));
    }
    return lines;
}

/// 0 without a number, such as null for one that is not finite.
double number_of(const Json& json, const char* key) {
    return json.contains(key) && json.at(key).is_number() ? json.at(key).get<double>() : 0;
}

/// run.json is of the start and of the end; what lies between is in metrics.jsonl.
void add_progress(ShownRun& run) {
    if (run.facts.value("state", "") != "running") return;
    const double start = number_of(run.facts, "step");
    for (const Json& line : run.metrics) {
        for (const char* key :
             {"step", "loss", "skipped", "peak_bytes", "val_psnr", "val_ssim", "gaussians"})
            if (line.contains(key)) run.facts[key] = line.at(key);
        if (line.contains("visible")) run.facts["ledger"] = line;
        const double psnr = number_of(line, "val_psnr");
        if (number_of(line, "step") > 0 && number_of(line, "step") >= start &&
            psnr > number_of(run.facts, "best_val_psnr"))
            run.facts["best_val_psnr"] = psnr;  // the training counts it without step 0, too
    }
}

/// A process trains in the folder. Source: RunFolder::lock().
bool is_locked(const std::string& folder) {
    const os::Handle file = os::open(folder + "/lock", os::Open::kRead);
    if (file == os::kNoHandle) return false;
    const bool free = os::lock(file, os::Lock::kShared, false) == 0;
    os::close(file);
    return !free;
}

ShownRun read_run(const std::string& folder) {
    std::ifstream file = open_to_read(os::path_of(folder) / "run.json");
    ShownRun run{folder, Json::parse(file, nullptr, false), read_metrics(os::path_of(folder))};
    if (!file.is_open())
        throw Failure(kBadData,
                      "'" + folder + "' holds no run: it has no run.json that can be read");
    if (!run.facts.is_object())
        throw Failure(kBadData, "'" + folder +
                                    "/run.json' is damaged: it is no JSON object; --resume "
                                    "of the run writes it again");
    add_progress(run);
    if (run.facts.value("state", "") == "running" && !is_locked(folder))
        run.facts["state"] = "killed";
    return run;
}

HtmlPage::Curve curve_of(const ShownRun& run, const char* key) {
    HtmlPage::Curve curve{run.folder, {}};
    for (const Json& line : run.metrics)
        if (line.contains(key) && line.at(key).is_number())
            curve.points.emplace_back(line.at("step").get<double>(), line.at(key).get<double>());
    return curve;
}

std::string latest_render(const ShownRun& run) {
    std::string latest;
    std::error_code none;
    for (const auto& entry :
         std::filesystem::directory_iterator(os::path_of(run.folder) / "renders", none))
        if (entry.path().extension() == ".png")
            latest = std::max(latest, os::text_of(entry.path()));
    return latest;
}

using Rows = std::vector<std::pair<std::string, std::string>>;

/// What a fit was asked to do, and its scene.
void add_fit(HtmlPage& page, const ShownRun& run, Rows& rows) {
    const auto number = [&](const char* key) { return number_of(run.facts, key); };
    rows.emplace_back("photographs", format("%.0f fitted, %.0f held out", number("photographs"),
                                            number("held_out")));
    std::ifstream file = open_to_read(os::path_of(run.folder) / "config.json");
    const Json config = Json::parse(file, nullptr, false);
    if (!config.is_object()) return;
    std::string settings;
    for (const auto& [key, value] : config.items())
        if (value != "") settings += (settings.empty() ? "" : ", ") + key + " " + value.dump();
    rows.emplace_back("settings", settings);
    if (run.facts.value("state", "") != "running") add_fitted_scene(page, run.folder, config);
}

void add_run(HtmlPage& page, const ShownRun& run) {
    page.heading(run.folder);
    Rows rows = {
        {"step", format("%u of %u, %s", run.facts.value("step", 0U),
                        run.facts.value("iterations", 0U), run.facts.value("state", "").c_str())}};
    if (run.facts.contains("error")) rows.emplace_back("error", run.facts.value("error", ""));
    const auto number = [&](const char* key, const char* name, const char* pattern, double factor) {
        if (run.facts.contains(key) && run.facts.at(key).is_number())
            rows.emplace_back(name, format(pattern, factor * run.facts.at(key).get<double>()));
    };
    number("loss", "loss", "%.6g", 1);
    number("val_psnr", run.is_fit() ? "held-out PSNR" : "validation PSNR", "%.2f dB", 1);
    if (run.is_fit()) number("val_ssim", "held-out SSIM", "%.4f", 1);
    if (number_of(run.facts, "best_val_psnr") != 0)
        number("best_val_psnr", "the best so far", "%.2f dB", 1);
    if (run.facts.value("skipped", 0U) > 0)
        number("skipped", "steps without an update", "%.0f, as gradients were not finite", 1);
    number("gaussians", "Gaussians", "%.0f", 1);
    number("parameters", "parameters", "%.0f", 1);
    number("trainable", "of them trained", "%.0f", 1);
    number("peak_bytes", "device memory", "at most %.1f MiB", 1.0 / (1 << 20));
    number("seed", "seed", "%.0f", 1);
    rows.emplace_back("library", "libsplat " + run.facts.value("library", ""));
    if (run.facts.contains("device"))
        rows.emplace_back("device", run.facts.at("device").value("name", ""));
    if (run.facts.contains("data")) {
        const Json& data = run.facts.at("data");
        rows.emplace_back("data",
                          format("%s, %u objects with %u views, trained on at %u pixels",
                                 data.value("format", "").c_str(), data.value("objects", 0U),
                                 data.value("views", 0U), data.value("resolution", 0U)));
    }
    if (run.facts.contains("ledger") && run.facts.at("ledger").is_object()) {
        const Json& ledger = run.facts.at("ledger");
        rows.emplace_back(
            "last step",
            format("%.0f pairs of a Gaussian and a target were visible, %.0f culled; %.0f numbers "
                   "of the network were not finite; %s",
                   ledger.value("visible", 0.0), ledger.value("culled", 0.0),
                   ledger.value("non_finite", 0.0),
                   ledger.value("gradients_zero", false) ? "all gradients were zero"
                                                         : "gradients were not zero"));
    }
    if (run.is_fit())
        add_fit(page, run, rows);
    else
        add_run_scene(page, run.folder);
    page.facts(rows);
    page.picture(latest_render(run),
                 run.is_fit()
                     ? "photographs that are held out: truth, drawn, error"
                     : "validation objects: input, then truth, prediction and error alternately",
                 1000);
}

/// The evaluations in the runs' folders.
void add_evaluations(HtmlPage& page, const RunEvaluations& found) {
    if (found.first.empty()) return;
    const std::string& baseline = found.table.baseline;
    std::vector<std::vector<std::string>> rows = {
        {"run", "metric", "mean", "objects", "against " + baseline, "95 % (percentile)",
         "95 % (BCa)", "p (permutation)", "p (Wilcoxon)", "objects won : tied : lost",
         "images won : tied : lost"}};
    for (const ComparedMetric& metric : found.first)
        rows.push_back({baseline, metric.metric, format("%.4f", metric.found.mean_b),
                        std::to_string(metric.found.n_b), "", "", "", "", "", "", ""});
    for (const auto& [method, compared] : found.table.rows) {
        const splat_metric_comparison& f = compared.found;
        const bool approximate = f.wilcoxon_exact == 0;
        rows.push_back({method, compared.metric, format("%.4f", f.mean_b), std::to_string(f.n_b),
                        format("%+.4f", f.difference), interval_text("%+.4f", f.low, f.high),
                        interval_text("%+.4f", f.bca_low, f.bca_high),
                        format("%.2g", f.p_permutation),
                        format("%.2g%s", f.p_wilcoxon, approximate ? " (normal)" : ""),
                        wins_text(f.wins_b, f.ties, f.wins_a),
                        wins_text(f.image_wins_b, f.image_ties, f.image_wins_a)});
    }
    page.heading("Evaluations, over the objects that both have");
    page.table(rows);
    page.paragraph(
        "Two-sided tests of pairs, not corrected for the number of metrics: all flips of the signs "
        "of up to 20 differences, else random ones, and Wilcoxon's signed rank test without "
        "differences of 0, exact or, "
        "where it says normal, approximated with a correction for ties. Intervals by bootstrap: "
        "percentiles, and bias-corrected and accelerated (BCa).");
    for (const std::string& note : found.notes) page.note(note);
}

/// A time such as 2026-11-26 18:40 UTC.
std::string now_text() {
    const std::time_t now = std::time(nullptr);
    char text[32];
    std::strftime(text, sizeof text, "%Y-%m-%d %H:%M UTC", std::gmtime(&now));
    return text;
}

}  // namespace

std::string write_run_report(const std::vector<std::string>& folders, const std::string& out,
                             bool running, const RunEvaluations* compared) {
    std::vector<ShownRun> runs;
    for (const std::string& folder : folders) runs.push_back(read_run(folder));
    const bool fits =
        std::all_of(runs.begin(), runs.end(), [](const auto& r) { return r.is_fit(); });
    const std::string what = fits ? "Fit" : "Training";
    HtmlPage page(runs.size() == 1 ? what + " " + runs[0].folder : what + " runs");
    if (running) {
        const std::uint32_t seconds = fits ? 10 : 30;
        page.reload(seconds);
        page.paragraph(
            format("Written at %s, while the %s went on. It is written anew at every "
                   "validation and at the end, and loads itself every %u s.",
                   now_text().c_str(), fits ? "fit" : "training", seconds));
    }
    const std::pair<const char*, const char*> charts[] = {
        {"val_psnr", fits ? "PSNR of photographs that are held out, dB, by step"
                          : "PSNR of novel views of validation objects, dB, by step"},
        {"val_ssim", "SSIM of the same, by step"},
        {"loss", fits ? "loss by step; it rises where the drawn views become larger"
                      : "training loss by step"},
        {"psnr", fits ? "PSNR of the step's photographs, dB, by step"
                      : "PSNR of training targets, dB, by step"},
        {"gaussians", "Gaussians by step"}};
    for (const auto& [key, caption] : charts) {
        std::vector<HtmlPage::Curve> curves;
        for (const ShownRun& run : runs) curves.push_back(curve_of(run, key));
        page.chart(caption, curves);
    }
    add_evaluations(page, compared == nullptr ? compare_evaluations(folders) : *compared);
    for (const ShownRun& run : runs) add_run(page, run);
    const std::string path = out.empty() ? runs[0].folder + "/report.html" : out;
    replace_file(path, page.text());
    return path;
}

}  // namespace vkrun

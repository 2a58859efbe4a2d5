#include "vkrun/compare/comparison_tables.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/text.h"

namespace vkrun {
namespace {

constexpr const char* kNone = "-";

std::string joined(const std::vector<std::string>& fields, const char* between) {
    std::string text;
    for (std::size_t i = 0; i < fields.size(); ++i) text += (i == 0 ? "" : between) + fields[i];
    return text;
}

std::string csv_number(double value) {
    return std::isnan(value) ? "" : format("%.9g", value);
}

std::string permutation_name(const ComparisonTable& table, const splat_metric_comparison& found) {
    if (found.exact != 0) return "all sign flips";
    return format("%u random %s", table.permutations, table.paired ? "sign flips" : "shuffles");
}

/// A text in LaTeX's text mode.
std::string latex_escaped(const std::string& text) {
    std::string out;
    for (const char c : text) {
        if (c == '\\')
            out += "\\textbackslash{}";
        else if (c == '~' || c == '^')
            out += std::string("\\") + c + "{}";
        else if (std::string("{}$&#_%").find(c) != std::string::npos)
            out += std::string("\\") + c;
        else
            out += std::iscntrl(static_cast<unsigned char>(c)) != 0 ? ' ' : c;
    }
    return out;
}

/// In math mode; 2.5e-5 takes half the width of a power of ten.
std::string latex_number(const char* pattern, double value) {
    if (std::isnan(value)) return "--";
    const std::string text = format(pattern, value);
    const std::size_t e = text.find('e');
    if (e == std::string::npos) return "$" + text + "$";
    return format("$%s\\mathrm{e}{%d}$", text.substr(0, e).c_str(), std::stoi(text.substr(e + 1)));
}

std::string latex_metric(const ComparedMetric& compared) {
    std::string name;
    for (const char c : compared.metric)
        name += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    return name + (compared.found.metric == SPLAT_METRIC_LPIPS ? " $\\downarrow$" : " $\\uparrow$");
}

std::string latex_wins(std::uint64_t wins, std::uint64_t ties, std::uint64_t losses) {
    if (wins + ties + losses == 0) return "--";
    return std::to_string(wins) + "/" + std::to_string(ties) + "/" + std::to_string(losses);
}

bool has_images(const ComparisonTable& table) {
    for (const auto& [method, compared] : table.rows) {
        const splat_metric_comparison& f = compared.found;
        if (f.image_wins_a + f.image_wins_b + f.image_ties != 0) return true;
    }
    return false;
}

std::string latex_row(const std::string& method, const ComparedMetric& compared, bool images) {
    const splat_metric_comparison& f = compared.found;
    const char* const mean = f.metric == SPLAT_METRIC_PSNR ? "%.3f" : "%.4f";
    const char* const apart = f.metric == SPLAT_METRIC_PSNR ? "%+.3f" : "%+.4f";
    const std::string mark = std::isnan(f.p_wilcoxon) || f.wilcoxon_exact != 0 ? "" : "$^\\approx$";
    std::vector<std::string> cells = {
        latex_escaped(method),
        latex_metric(compared),
        std::to_string(f.n_a) + (f.n_a == f.n_b ? "" : ", " + std::to_string(f.n_b)),
        latex_number(mean, f.mean_a),
        latex_number(mean, f.mean_b),
        latex_number(apart, f.difference),
        std::isnan(f.bca_low) || std::isnan(f.bca_high)
            ? "--"
            : "$[" + format(apart, f.bca_low) + ", " + format(apart, f.bca_high) + "]$",
        latex_number("%.2g", f.p_holm),
        latex_number("%.2g", f.p_wilcoxon_holm) + mark,
        latex_wins(f.wins_b, f.ties, f.wins_a)};
    if (images) cells.push_back(latex_wins(f.image_wins_b, f.image_ties, f.image_wins_a));
    return joined(cells, " & ") + " \\\\\n";
}

std::string latex_caption(const ComparisonTable& table, bool images) {
    std::string text = "Means over objects, compared with " + latex_escaped(table.baseline) +
                       (table.paired ? ", paired by object." : ", not paired.");
    text += format(
        " $\\Delta$: mean difference, with its 95\\%% bootstrap interval, bias-corrected and "
        "accelerated (BCa, Efron 1987; %u samples).",
        table.bootstraps);
    text += format(" $p$: two-sided permutation test (%s%u random %s)",
                   table.paired ? "all sign flips of up to 20 differences, else " : "",
                   table.permutations, table.paired ? "ones" : "shuffles of all scores");
    text +=
        format(", Holm-corrected for %zu metric%s.", table.metrics, table.metrics == 1 ? "" : "s");
    if (!table.paired) return text;
    text +=
        " $p_W$: two-sided Wilcoxon signed rank test, exact, or where marked $^\\approx$ by its "
        "normal approximation with tie correction; differences of 0 dropped (Wilcoxon's rule); "
        "Holm-corrected alike. W/T/L: objects won, tied, lost";
    return text + (images ? ", and images." : ".");
}

}  // namespace

std::vector<ComparedMetric> compared_metrics(splat_comparison comparison, const Json& report) {
    std::vector<ComparedMetric> metrics;
    for (const Json& row : report.at("metrics")) {
        metrics.push_back({row.at("metric"), row.at("verdict"), sized<splat_metric_comparison>()});
        check(splat_comparison_metric(comparison, static_cast<std::uint32_t>(metrics.size() - 1),
                                      &metrics.back().found));
    }
    return metrics;
}

void ComparisonTable::add(const std::string& method, const std::vector<ComparedMetric>& compared,
                          const Json& report) {
    paired = report.at("paired");
    permutations = report.at("permutations");
    bootstraps = report.at("bootstraps");
    metrics = std::max(metrics, compared.size());
    for (const ComparedMetric& metric : compared) rows.push_back({method, metric});
}

std::string rank_test_name(const splat_metric_comparison& found) {
    if (std::isnan(found.p_wilcoxon)) return kNone;
    return found.wilcoxon_exact != 0 ? "exact" : "normal approximation with tie correction";
}

std::string wins_text(std::uint64_t wins, std::uint64_t ties, std::uint64_t losses) {
    if (wins + ties + losses == 0) return kNone;
    return std::to_string(wins) + " : " + std::to_string(ties) + " : " + std::to_string(losses);
}

std::string interval_text(const char* pattern, double low, double high) {
    if (std::isnan(low) || std::isnan(high)) return kNone;
    return format(pattern, low) + " to " + format(pattern, high);
}

std::string comparison_csv(const ComparisonTable& table) {
    std::string csv =
        "baseline,method,metric,n_baseline,n,mean_baseline,mean,difference,percentile_low,"
        "percentile_high,bca_low,bca_high,bootstrap_samples,p_permutation,p_permutation_holm,"
        "permutation_test,p_parametric,parametric_test,cohens_d,p_wilcoxon,p_wilcoxon_holm,"
        "wilcoxon_test,wilcoxon_w,wilcoxon_n,wins,ties,losses,image_wins,image_ties,image_losses,"
        "verdict\r\n";
    const auto number = csv_number;
    const auto count = [](std::uint64_t value) { return std::to_string(value); };
    for (const auto& [method, compared] : table.rows) {
        const splat_metric_comparison& f = compared.found;
        std::vector<std::string> fields = {
            csv_field(table.baseline),
            csv_field(method),
            compared.metric,
            count(f.n_a),
            count(f.n_b),
            number(f.mean_a),
            number(f.mean_b),
            number(f.difference),
            number(f.low),
            number(f.high),
            number(f.bca_low),
            number(f.bca_high),
            count(table.bootstraps),
            number(f.p_permutation),
            number(f.p_holm),
            permutation_name(table, f),
            number(f.p_parametric),
            table.paired ? "paired Student's t" : "normal distribution of means",
            number(f.effect)};
        std::vector<std::string> pairs = {number(f.p_wilcoxon),
                                          number(f.p_wilcoxon_holm),
                                          "signed rank: " + rank_test_name(f) + "; zeros dropped",
                                          number(f.wilcoxon_w),
                                          count(f.wilcoxon_n),
                                          count(f.wins_b),
                                          count(f.ties),
                                          count(f.wins_a),
                                          count(f.image_wins_b),
                                          count(f.image_ties),
                                          count(f.image_wins_a)};
        if (!table.paired) pairs.assign(pairs.size(), "");
        fields.insert(fields.end(), pairs.begin(), pairs.end());
        fields.push_back(compared.verdict);
        csv += joined(fields, ",") + "\r\n";
    }
    return csv;
}

std::string comparison_latex(const ComparisonTable& table) {
    const bool images = has_images(table);
    std::string text =
        "\\begin{table}\n\\centering\\scriptsize\\setlength{\\tabcolsep}{1.4pt}\n\\caption{" +
        latex_caption(table, images) + "}\n\\smallskip\n\\begin{tabular}{@{}llrrrrcrrc" +
        (images ? "c" : "") + "@{}}\n\\hline\n" +
        "Method & Metric & $n$ & Base & Mean & $\\Delta$ & BCa interval & $p$ & "
        "$p_W$ & W/T/L" +
        (images ? " & images" : "") + " \\\\\n\\hline\n";
    for (const auto& [method, compared] : table.rows) text += latex_row(method, compared, images);
    return text + "\\hline\n\\end{tabular}\n\\end{table}\n";
}

}  // namespace vkrun

#include <algorithm>
#include <cmath>

#include "api/api_guard.h"
#include "api/handles.h"

using namespace splat;

static_assert(SPLAT_VERDICT_NO_DIFFERENCE == static_cast<int>(eval::Verdict::kNoDifference));
static_assert(SPLAT_VERDICT_BETTER == static_cast<int>(eval::Verdict::kBetter));
static_assert(SPLAT_VERDICT_WORSE == static_cast<int>(eval::Verdict::kWorse));
static_assert(SPLAT_VERDICT_NOT_COMPARABLE == static_cast<int>(eval::Verdict::kNotComparable));
static_assert(SPLAT_VERDICT_TOO_FEW == static_cast<int>(eval::Verdict::kTooFew));

namespace {

/// The scores of a file or an array; `name` is "a" or "b".
Result<eval::ScoreTable> score_table(const splat_score_set& set, const char* name) {
    if (set.path != nullptr && set.score_count != 0)
        return invalid("splat_compare_desc.%s has a path and scores, expected one of them", name);
    if (set.path != nullptr) return eval::read_scores(set.path);
    if (set.score_count == 0)
        return invalid("splat_compare_desc.%s has no scores, expected a path or an array", name);
    SPLAT_TRY(api::require(set.scores, format("desc.%s.scores", name).c_str()));
    eval::ScoreTable table;
    for (std::uint64_t i = 0; i < set.score_count; ++i) {
        const splat_score& score = set.scores[i];
        SPLAT_TRY(api::require(score.object,
                               format("desc.%s.scores[%llu].object", name, llu(i)).c_str()));
        if (!table.objects.insert(score.object).second)
            return invalid("splat_compare_desc.%s has the object '%s' twice, expected it once",
                           name, score.object);
        const double values[] = {score.psnr, score.ssim, score.lpips};
        for (std::size_t metric = 0; metric < std::size(values); ++metric)
            if (std::isfinite(values[metric]))
                table.values[eval::kMetrics[metric]][score.object] = values[metric];
    }
    eval::list_metrics(table);
    return table;
}

/// The number of a metric.
splat_metric metric_of(const std::string& name) {
    const auto* const place = std::ranges::find(eval::kMetrics, name);
    return SPLAT_METRIC_PSNR + static_cast<splat_metric>(place - std::begin(eval::kMetrics));
}

/// Call `body(finding)` with the comparison in one metric.
template <class Body>
splat_result with_metric(splat_comparison comparison, std::uint32_t index, Body&& body) {
    return api::with(comparison, [&](const auto& found) -> Status {
        const std::vector<eval::MetricFinding>& metrics = found->comparison.metrics;
        if (index >= metrics.size())
            return invalid("index is %u, expected less than %zu metrics", index, metrics.size());
        return body(metrics[index]);
    });
}

Status check_samples(const double* samples, std::uint64_t room, std::size_t needed,
                     const char* argument) {
    if (samples == nullptr || room >= needed) return {};
    return invalid("%s is %llu, expected %zu or more", argument, llu(room), needed);
}

}  // namespace

splat_result splat_compare_scores(const splat_compare_desc* desc, splat_comparison* comparison) {
    return api::create(comparison, [&]() -> api::Comparisons::Made {
        SPLAT_TRY(api::check_desc(desc, SPLAT_COMPARE_UNPAIRED));
        SPLAT_ASSIGN(const eval::ScoreTable a, score_table(desc->a, "a"));
        SPLAT_ASSIGN(const eval::ScoreTable b, score_table(desc->b, "b"));
        eval::CompareOptions options;
        options.unpaired = (desc->flags & SPLAT_COMPARE_UNPAIRED) != 0;
        options.resample.seed = desc->seed;
        if (desc->resamples != 0) options.resample.permutations = desc->resamples;
        if (desc->bootstraps != 0) options.resample.bootstraps = desc->bootstraps;
        auto object = std::make_shared<api::ComparisonObject>();
        SPLAT_ASSIGN(object->comparison, eval::compare_scores(a, b, options));
        return object;
    });
}

splat_result splat_comparison_get_info(splat_comparison comparison, splat_comparison_info* info) {
    return api::describe(comparison, info, "info", [&](auto& object) {
        const eval::ScoreComparison& found = object.comparison;
        splat_comparison_info filled{};
        filled.metrics = static_cast<std::uint32_t>(found.metrics.size());
        SPLAT_COPY(filled, found, objects_a, objects_b, unpaired, comparable);
        filled.shared_objects = found.shared;
        return filled;
    });
}

splat_result splat_comparison_metric(splat_comparison comparison, uint32_t index,
                                     splat_metric_comparison* metric) {
    return with_metric(comparison, index, [&](const eval::MetricFinding& finding) -> Status {
        SPLAT_TRY(api::check_fill(metric, "metric"));
        const eval::Comparison& c = finding.comparison;
        splat_metric_comparison filled{};
        filled.metric = metric_of(finding.samples.metric);
        filled.verdict = static_cast<splat_verdict>(finding.verdict);
        SPLAT_COPY(filled, c, exact, difference, p_permutation, p_parametric, low, high, effect,
                   bca_low, bca_high);
        filled.mean_a = eval::mean(finding.samples.a);
        filled.mean_b = eval::mean(finding.samples.b);
        filled.p_holm = finding.p_holm;
        filled.n_a = finding.samples.a.size();
        filled.n_b = finding.samples.b.size();
        filled.lacking_a = finding.samples.lacking_a;
        filled.lacking_b = finding.samples.lacking_b;
        filled.p_wilcoxon = finding.rank.p;
        filled.p_wilcoxon_holm = finding.rank_holm;
        filled.wilcoxon_w = finding.rank.positive;
        filled.wilcoxon_n = finding.rank.n;
        filled.wilcoxon_exact = finding.rank.exact ? 1 : 0;
        filled.wilcoxon_tied = finding.rank.tied ? 1 : 0;
        filled.wins_a = finding.objects.a;
        filled.wins_b = finding.objects.b;
        filled.ties = finding.objects.ties;
        filled.image_wins_a = finding.images.a;
        filled.image_wins_b = finding.images.b;
        filled.image_ties = finding.images.ties;
        api::give(filled, metric);
        return {};
    });
}

splat_result splat_comparison_samples(splat_comparison comparison, uint32_t index, double* a,
                                      uint64_t a_count, double* b, uint64_t b_count) {
    return with_metric(comparison, index, [&](const eval::MetricFinding& finding) -> Status {
        const eval::MetricSamples& samples = finding.samples;
        SPLAT_TRY(check_samples(a, a_count, samples.a.size(), "a_count"));
        SPLAT_TRY(check_samples(b, b_count, samples.b.size(), "b_count"));
        if (a != nullptr) std::ranges::copy(samples.a, a);
        if (b != nullptr) std::ranges::copy(samples.b, b);
        return {};
    });
}

splat_result splat_comparison_report(splat_comparison comparison, char* buffer, size_t capacity,
                                     size_t* needed) {
    return api::report(comparison, buffer, capacity, needed,
                       [](auto& object) { return eval::comparison_text(object.comparison); });
}

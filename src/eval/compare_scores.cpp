#include "eval/compare_scores.h"

#include <algorithm>

#include "eval/json_number.h"

namespace splat::eval {
namespace {

constexpr const char* kApart =
    "A and B share no object: their difference may come from the objects alone, whatever a test "
    "says";

std::size_t shared_objects(const ScoreTable& a, const ScoreTable& b) {
    return static_cast<std::size_t>(std::ranges::count_if(
        a.objects, [&b](const std::string& name) { return b.objects.contains(name); }));
}

Verdict verdict_of(const MetricFinding& finding, const ScoreComparison& found) {
    const MetricSamples& samples = finding.samples;
    if (!found.comparable || samples.lacking_a + samples.lacking_b > 0)
        return Verdict::kNotComparable;
    if (too_few(samples.a.size(), samples.b.size(), found.metrics.size(), kLevel, found.unpaired))
        return Verdict::kTooFew;
    if (!(finding.p_holm < kLevel)) return Verdict::kNoDifference;
    const bool higher = finding.comparison.difference > 0;
    return higher != (finding.samples.metric == "lpips") ? Verdict::kBetter : Verdict::kWorse;
}

std::string note_on(const ScoreComparison& found) {
    if (found.shared == 0) return kApart;
    if (!found.comparable)
        return "A and B do not cover the same objects: their difference may come from the objects "
               "alone; in pairs, the objects in both are compared";
    std::string note;
    if (found.shared < std::max(found.objects_a, found.objects_b))
        note = format("%zu objects of A and %zu of B are in one file only and are left out",
                      found.objects_a - found.shared, found.objects_b - found.shared);
    for (const MetricFinding& finding : found.metrics) {
        const MetricSamples& samples = finding.samples;
        if (samples.lacking_a + samples.lacking_b == 0) continue;
        note += format(
            "%s%s: A lacks a finite score of %zu objects that B has, B of %zu that A has; "
            "the others do not tell which is better",
            note.empty() ? "" : "; ", samples.metric.c_str(), samples.lacking_a, samples.lacking_b);
    }
    return note;
}

void write_metric(const MetricFinding& finding, bool unpaired, JsonWriter& json) {
    const Comparison& c = finding.comparison;
    const std::vector<double>& a = finding.samples.a;
    const std::vector<double>& b = finding.samples.b;
    json.newline(1).begin_object().member("metric", finding.samples.metric);
    write_number(json.key("mean_a"), mean(a));
    write_number(json.key("mean_b"), mean(b));
    write_number(json.key("observed_difference"), c.difference);
    write_number(json.key("p_permutation"), c.p_permutation);
    write_number(json.key("p_parametric"), c.p_parametric);
    write_number(json.key("p_holm"), finding.p_holm);
    json.key("ci").begin_array();
    write_number(json, c.low);
    write_number(json, c.high);
    json.end();
    write_number(json.key("effect_size"), c.effect);
    json.member("n_pairs", unpaired ? 0 : a.size()).member("n_a", a.size()).member("n_b", b.size());
    json.member("lacking_a", finding.samples.lacking_a);
    json.member("lacking_b", finding.samples.lacking_b);
    json.member("exact", c.exact).member("verdict", verdict_name(finding.verdict)).end();
}

}  // namespace

const char* verdict_name(Verdict verdict) {
    constexpr const char* kNames[] = {"no difference shown", "better", "worse", "not comparable",
                                      "too few objects"};
    return kNames[static_cast<std::size_t>(verdict)];
}

Result<ScoreComparison> compare_scores(const ScoreTable& a, const ScoreTable& b,
                                       const CompareOptions& options) {
    ScoreComparison found;
    found.path_a = a.path;
    found.path_b = b.path;
    found.unpaired = options.unpaired;
    found.resample = options.resample;
    found.objects_a = a.objects.size();
    found.objects_b = b.objects.size();
    found.shared = shared_objects(a, b);
    if (found.shared == 0 && !options.unpaired)
        return not_found(
            "%s. Evaluate both on the same split, or compare them unpaired for the "
            "numbers",
            kApart);
    if (found.shared != 0) SPLAT_TRY(check_same_views(a, b));
    // Unpaired scores cover the same objects only if both tables have all of them.
    found.comparable =
        found.shared != 0 &&
        (!options.unpaired || (found.shared == found.objects_a && found.shared == found.objects_b));
    std::vector<double> p;
    for (MetricSamples& samples : samples_of(a, b, options.unpaired)) {
        MetricFinding finding;
        finding.comparison = options.unpaired
                                 ? compare_pooled(samples.a, samples.b, options.resample)
                                 : compare_paired(samples.a, samples.b, options.resample);
        finding.samples = std::move(samples);
        p.push_back(finding.comparison.p_permutation);
        found.metrics.push_back(std::move(finding));
    }
    found.least =
        least_objects(std::max<std::size_t>(found.metrics.size(), 1), kLevel, options.unpaired);
    if (found.metrics.empty())
        return not_found(
            "A and B have no metric with finite scores of both: there is nothing to compare");
    const std::vector<double> adjusted = holm(p);
    for (std::size_t i = 0; i < adjusted.size(); ++i) {
        found.metrics[i].p_holm = adjusted[i];
        found.metrics[i].verdict = verdict_of(found.metrics[i], found);
    }
    found.note = note_on(found);
    return found;
}

std::string comparison_text(const ScoreComparison& found) {
    JsonWriter json;
    json.begin_object().member("a", found.path_a).member("b", found.path_b);
    json.member("paired", !found.unpaired).member("objects_a", found.objects_a);
    json.member("objects_b", found.objects_b).member("shared_objects", found.shared);
    json.member("least_objects", found.least);
    json.member("seed", found.resample.seed).member("permutations", found.resample.permutations);
    json.member("note", found.note).key("metrics").begin_array();
    for (const MetricFinding& finding : found.metrics) write_metric(finding, found.unpaired, json);
    json.end().end();
    return json.text();
}

}  // namespace splat::eval

#include "eval/compare_scores.h"

#include <algorithm>
#include <cmath>
#include <map>

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

bool less_is_better(const std::string& metric) {
    return metric == "lpips";
}

/// The views of objects of both that have the score in both.
Wins image_wins(const ImageTable& a, const ImageTable& b, const std::string& metric) {
    const auto score = metric == "psnr"   ? &ViewScores::psnr
                       : metric == "ssim" ? &ViewScores::ssim
                                          : &ViewScores::lpips;
    Wins wins;
    for (const auto& [object, views] : b) {
        const auto other = a.find(object);
        if (other == a.end()) continue;
        std::map<std::uint32_t, double> of_a;
        for (const ViewScores& view : other->second) of_a.emplace(view.view, view.*score);
        for (const ViewScores& view : views) {
            const auto found = of_a.find(view.view);
            if (found != of_a.end() && !std::isnan(found->second) && !std::isnan(view.*score))
                wins.count(found->second, view.*score, less_is_better(metric));
        }
    }
    return wins;
}

MetricFinding finding_of(MetricSamples samples, const CompareOptions& options) {
    MetricFinding finding;
    const std::vector<double>&a = samples.a, &b = samples.b;
    if (options.unpaired) {
        finding.comparison = compare_pooled(a, b, options.resample);
        finding.rank.p = NAN;
    } else {
        finding.comparison = compare_paired(a, b, options.resample);
        finding.rank = signed_rank_test(a, b);
        for (std::size_t i = 0; i < a.size(); ++i)
            finding.objects.count(a[i], b[i], less_is_better(samples.metric));
    }
    finding.samples = std::move(samples);
    return finding;
}

Verdict verdict_of(const MetricFinding& finding, const ScoreComparison& found) {
    const MetricSamples& samples = finding.samples;
    if (!found.comparable || samples.lacking_a + samples.lacking_b > 0)
        return Verdict::kNotComparable;
    if (too_few(samples.a.size(), samples.b.size(), found.metrics.size(), kLevel, found.unpaired))
        return Verdict::kTooFew;
    if (!(finding.p_holm < kLevel)) return Verdict::kNoDifference;
    const bool higher = finding.comparison.difference > 0;
    return higher != less_is_better(finding.samples.metric) ? Verdict::kBetter : Verdict::kWorse;
}

std::string note_on(const ScoreComparison& found) {
    if (found.shared == 0) return kApart;
    if (!found.comparable)
        return "A and B do not cover the same objects: their difference may come from the objects "
               "alone; in pairs, the objects in both are compared";
    std::string note;
    const auto add = [&note](const std::string& sentence) {
        note += (note.empty() ? "" : "; ") + sentence;
    };
    if (found.shared < std::max(found.objects_a, found.objects_b))
        add(format("%zu objects of A and %zu of B are in one file only and are left out",
                   found.objects_a - found.shared, found.objects_b - found.shared));
    const std::size_t least = least_objects(1, kLevel, false);  // the tests of signs and of ranks
    for (const MetricFinding& finding : found.metrics) {
        const MetricSamples& samples = finding.samples;
        if (samples.lacking_a + samples.lacking_b != 0)
            add(
                format("%s: A lacks a finite score of %zu objects that B has, B of %zu that A has; "
                       "the others do not tell which is better",
                       samples.metric.c_str(), samples.lacking_a, samples.lacking_b));
        if (!found.unpaired && finding.rank.n != 0 && finding.rank.n < least)
            add(
                format("%s: %zu objects differ, and Wilcoxon's test takes %zu or more to tell a "
                       "difference from chance",
                       samples.metric.c_str(), finding.rank.n, least));
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
    for (const auto& [key, low, high] :
         {std::tuple{"ci", c.low, c.high}, {"ci_bca", c.bca_low, c.bca_high}}) {
        write_number(json.key(key).begin_array(), low);
        write_number(json, high);
        json.end();
    }
    write_number(json.key("effect_size"), c.effect);
    json.member("n_pairs", unpaired ? 0 : a.size()).member("n_a", a.size()).member("n_b", b.size());
    json.member("lacking_a", finding.samples.lacking_a);
    json.member("lacking_b", finding.samples.lacking_b);
    json.member("exact", c.exact);
    write_number(json.key("p_wilcoxon"), finding.rank.p);
    write_number(json.key("p_wilcoxon_holm"), finding.rank_holm);
    write_number(json.key("wilcoxon_w"), finding.rank.positive);
    json.member("wilcoxon_n", finding.rank.n).member("wilcoxon_exact", finding.rank.exact);
    json.member("wilcoxon_tied", finding.rank.tied);
    const Wins &objects = finding.objects, &images = finding.images;
    json.member("wins_a", objects.a).member("wins_b", objects.b).member("ties", objects.ties);
    json.member("image_wins_a", images.a).member("image_wins_b", images.b);
    json.member("image_ties", images.ties).member("verdict", verdict_name(finding.verdict)).end();
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
    std::vector<double> p, of_ranks;
    for (MetricSamples& samples : samples_of(a, b, options.unpaired)) {
        MetricFinding finding = finding_of(std::move(samples), options);
        if (!options.unpaired)
            finding.images = image_wins(a.images, b.images, finding.samples.metric);
        p.push_back(finding.comparison.p_permutation);
        of_ranks.push_back(finding.rank.p);
        found.metrics.push_back(std::move(finding));
    }
    found.least =
        least_objects(std::max<std::size_t>(found.metrics.size(), 1), kLevel, options.unpaired);
    if (found.metrics.empty())
        return not_found(
            "A and B have no metric with finite scores of both: there is nothing to compare");
    const std::vector<double> adjusted = holm(p);
    const std::vector<double> adjusted_ranks = options.unpaired ? of_ranks : holm(of_ranks);
    for (std::size_t i = 0; i < adjusted.size(); ++i) {
        found.metrics[i].p_holm = adjusted[i];
        found.metrics[i].rank_holm = adjusted_ranks[i];
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
    json.member("bootstraps", found.resample.bootstraps);
    json.member("note", found.note).key("metrics").begin_array();
    for (const MetricFinding& finding : found.metrics) write_metric(finding, found.unpaired, json);
    json.end().end();
    return json.text();
}

}  // namespace splat::eval

#pragma once

#include "eval/score_table.h"
#include "eval/signed_rank.h"
#include "eval/significance.h"

namespace splat::eval {

/// Below this p, corrected for the number of metrics, a difference is called better or worse.
inline constexpr double kLevel = 0.05;

enum class Verdict { kNoDifference, kBetter, kWorse, kNotComparable, kTooFew };

/// "no difference shown", "better", "worse", "not comparable", "too few objects"
const char* verdict_name(Verdict verdict);

/// B against A in one metric.
struct MetricFinding {
    MetricSamples samples;
    Comparison comparison;
    double p_holm = 1;     ///< p_permutation corrected for the number of metrics
    RankTest rank;         ///< the test of pairs; its p is NaN without them
    double rank_holm = 1;  ///< p of `rank`, corrected for the number of metrics
    Wins objects;          ///< counts pairs of objects
    Wins images;           ///< counts views of both, where files tell them
    Verdict verdict = Verdict::kNoDifference;
};

struct CompareOptions {
    bool unpaired = false;
    ResampleOptions resample;
};

/// B against A.
struct ScoreComparison {
    std::string path_a, path_b;  ///< files of the tables
    bool unpaired = false;
    ResampleOptions resample;
    std::size_t objects_a = 0, objects_b = 0;
    std::size_t shared = 0;   ///< objects of both
    bool comparable = false;  ///< false: the difference may come from the objects alone
    std::size_t least = 0;    ///< objects with which a difference in so many metrics can be shown
    std::string note;         ///< on objects of one table only; may be empty
    std::vector<MetricFinding> metrics;
};

/// Test whether B is better than A in each metric that both have. Errors: kNotFound if they share no object
/// and are compared in pairs; check_same_views().
Result<ScoreComparison> compare_scores(const ScoreTable& a, const ScoreTable& b,
                                       const CompareOptions& options);

/// JSON: {"a", "b" (paths), "paired", "objects_a", "objects_b", "shared_objects", "least_objects", "seed",
/// "permutations", "bootstraps", "note", "metrics": [{"metric", "mean_a", "mean_b", "observed_difference",
/// "p_permutation", "p_parametric", "p_holm", "ci": [low, high], "ci_bca": [low, high], "effect_size" (null: infinite,
/// or of one pair), "n_pairs", "n_a", "n_b", "lacking_a", "lacking_b", "exact", "p_wilcoxon", "p_wilcoxon_holm",
/// "wilcoxon_w", "wilcoxon_n", "wilcoxon_exact", "wilcoxon_tied", "wins_a", "wins_b", "ties", "image_wins_a",
/// "image_wins_b", "image_ties", "verdict"}]}.
std::string comparison_text(const ScoreComparison& comparison);

}  // namespace splat::eval

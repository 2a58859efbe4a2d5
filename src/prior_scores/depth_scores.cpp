#include "prior_scores/depth_scores.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "prior_scores/check_map.h"

namespace splat::prior_scores {
namespace {

constexpr double kLeastDepth = 1e-8;  ///< the published value

/// The pixels that count.
struct DepthPairs {
    std::vector<double> p, g;
};

Result<DepthPairs> pairs_inside(std::span<const float> prediction, std::span<const float> truth,
                                std::span<const float> mask) {
    DepthPairs pairs;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        if (!(mask[i] > 0.5F)) continue;
        if (!std::isfinite(prediction[i]) || !std::isfinite(truth[i]) || !(truth[i] > 0))
            return invalid(
                "inside of the mask, at number %zu, the prediction is %g and the truth %g, "
                "expected finite numbers and a truth > 0",
                i, static_cast<double>(prediction[i]), static_cast<double>(truth[i]));
        pairs.p.push_back(static_cast<double>(prediction[i]));
        pairs.g.push_back(static_cast<double>(truth[i]));
    }
    return pairs;
}

Result<DepthPairs> pairs_of(std::span<const float> prediction, std::span<const float> truth,
                            DepthRule rule) {
    constexpr const char* kRemedy = "; leave such pixels out with a mask";
    SPLAT_TRY(check_map(prediction, truth.size(), "the predicted depth", kRemedy));
    SPLAT_TRY(check_map(truth, truth.size(), "the true depth", kRemedy));
    DepthPairs pairs;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        const auto p = static_cast<double>(prediction[i]);
        const auto g = static_cast<double>(truth[i]);
        if (rule == DepthRule::kValid && !(g > 0)) continue;
        const bool clamp = rule == DepthRule::kPublished;
        pairs.p.push_back(clamp ? std::max(p, kLeastDepth) : p);
        pairs.g.push_back(clamp ? std::max(g, kLeastDepth) : g);
    }
    return pairs;
}

double mean_of(const std::vector<double>& values) {
    double sum = 0;
    for (const double value : values) sum += value;
    return sum / static_cast<double>(values.size());
}

void align(DepthPairs& pairs, DepthScores& scores) {
    const double mp = mean_of(pairs.p);
    const double mg = mean_of(pairs.g);
    double pp = 0, pg = 0;
    for (std::size_t i = 0; i < pairs.p.size(); ++i) {
        pp += (pairs.p[i] - mp) * (pairs.p[i] - mp);
        pg += (pairs.p[i] - mp) * (pairs.g[i] - mg);
    }
    scores.scale = pp > 0 ? pg / pp : 0;
    scores.shift = mg - scores.scale * mp;
    for (double& p : pairs.p) p = scores.scale * p + scores.shift;
}

}  // namespace

Result<DepthScores> compare_depth(std::span<const float> prediction, std::span<const float> truth,
                                  std::span<const float> mask, DepthRule rule) {
    if (prediction.size() != truth.size() || (!mask.empty() && mask.size() != truth.size()))
        return error(Code::kShape,
                     "the predicted depth has %zu numbers, the true one %zu and the mask %zu, "
                     "expected the same number",
                     prediction.size(), truth.size(), mask.size());
    if (rule == DepthRule::kPublished && !mask.empty())
        return invalid("a mask is given, but as published every pixel counts");
    SPLAT_ASSIGN(DepthPairs pairs, mask.empty() ? pairs_of(prediction, truth, rule)
                                                : pairs_inside(prediction, truth, mask));
    if (pairs.p.empty())
        return invalid("no pixel counts: %s", mask.empty() ? "the true depth is nowhere > 0"
                                                           : "the mask is nowhere > 0.5");
    DepthScores scores;
    scores.pixels = pairs.p.size();
    align(pairs, scores);
    double relative = 0, squares = 0, logs = 0, log_squares = 0;
    for (std::size_t i = 0; i < pairs.p.size(); ++i) {
        const double p = pairs.p[i], g = pairs.g[i];
        relative += std::abs(p - g) / g;
        squares += (p - g) * (p - g);
        const double d = std::log(std::max(p, kLeastDepth)) - std::log(std::max(g, kLeastDepth));
        logs += d;
        log_squares += d * d;
        const double ratio = std::max(p / g, g / p);
        const bool counts = rule == DepthRule::kPublished || p > 0;
        for (std::size_t k = 0; k < 3; ++k)
            if (counts && ratio < std::pow(1.25, k + 1)) scores.within[k] += 1;
    }
    const auto n = static_cast<double>(pairs.p.size());
    scores.abs_rel = relative / n;
    scores.rmse = std::sqrt(squares / n);
    scores.si_rmse = std::sqrt(std::max(0.0, log_squares / n - logs / n * (logs / n)));
    for (double& share : scores.within) share /= n;
    return scores;
}

}  // namespace splat::prior_scores

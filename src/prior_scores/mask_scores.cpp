#include "prior_scores/mask_scores.h"

#include <cmath>

#include "prior_scores/check_map.h"

namespace splat::prior_scores {

Result<MaskScores> compare_masks(std::span<const float> prediction, std::span<const float> alpha,
                                 double threshold) {
    SPLAT_TRY(check_unit_map(prediction, alpha.size(), "the predicted mask"));
    SPLAT_TRY(check_unit_map(alpha, alpha.size(), "the true mask"));
    constexpr double kTiny = 1e-6;
    MaskScores scores;
    std::uint64_t both = 0;
    for (std::size_t i = 0; i < alpha.size(); ++i) {
        const auto p = static_cast<double>(prediction[i]);
        const bool g = static_cast<double>(alpha[i]) > threshold;
        scores.mae += std::abs(p - (g ? 1.0 : 0.0));
        if (g) ++scores.true_pixels;
        if (p > 0.5) ++scores.predicted_pixels;
        if (g && p > 0.5) ++both;
    }
    const auto shared = static_cast<double>(both);
    const auto predicted = static_cast<double>(scores.predicted_pixels);
    const auto known = static_cast<double>(scores.true_pixels);
    scores.mae /= static_cast<double>(alpha.size());
    scores.iou = shared / (predicted + known - shared + kTiny);
    scores.precision = shared / (predicted + kTiny);
    scores.recall = shared / (known + kTiny);
    scores.f_beta =
        1.3 * scores.precision * scores.recall / (0.3 * scores.precision + scores.recall + kTiny);
    return scores;
}

}  // namespace splat::prior_scores

#include "vkrun/eval/scoring.h"

#include "vkrun/cli/progress.h"
#include "vkrun/cli/text.h"

namespace vkrun {
namespace {

/// Empty if all numbers are finite.
std::string fault_of(const splat_object_scores& scores) {
    if (scores.not_finite == 0) return "";
    return format(
        "object '%s' has no scores: %llu numbers of the network's output, %llu of %llu "
        "Gaussians and %u images are not finite",
        scores.name, static_cast<unsigned long long>(scores.ledger.outputs_not_finite),
        static_cast<unsigned long long>(scores.ledger.gaussians_not_finite),
        static_cast<unsigned long long>(scores.ledger.gaussians), scores.ledger.images_not_finite);
}

}  // namespace

splat_object_scores score_by_network(splat_evaluator evaluator, std::uint32_t object) {
    auto scores = sized<splat_object_scores>();
    check(splat_evaluator_score(evaluator, object, &scores));
    return scores;
}

ScoredObjects score_objects(splat_evaluator evaluator, const std::string& title, const Shard& shard,
                            const ScoreObject& score) {
    auto info = sized<splat_evaluator_info>();
    check(splat_evaluator_get_info(evaluator, &info));
    ScoredObjects scored;
    Progress progress(title, info.objects);
    for (std::uint32_t i = shard.index; i < info.objects; i += shard.count) {
        progress.show(i);
        const splat_object_scores scores = score(i);
        scored.rows.push_back(
            {i, scores.name, scores.novel.psnr, scores.novel.ssim, scores.conditioning.psnr});
        if (const std::string fault = fault_of(scores); !fault.empty())
            scored.faults.push_back(fault);
    }
    progress.show(info.objects);
    return scored;
}

void check_finite(const ScoredObjects& scored) {
    if (scored.faults.empty()) return;
    throw Failure(kNotFinite,
                  format("%s; %zu of %zu objects are like this, and there is no mean score. The "
                         "weights overflow float32: train again, or give others",
                         scored.faults.front().c_str(), scored.faults.size(), scored.rows.size()));
}

}  // namespace vkrun

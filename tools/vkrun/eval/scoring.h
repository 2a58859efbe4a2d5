#pragma once

#include <functional>
#include <string>
#include <vector>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/shard.h"
#include "vkrun/eval/eval_report.h"

namespace vkrun {

/// Objects that were scored, and a sentence on each that has numbers that are not finite.
struct ScoredObjects {
    std::vector<ObjectRow> rows;
    std::vector<std::string> faults;
};

using ScoreObject = std::function<splat_object_scores(std::uint32_t object)>;

/// Score an object by the evaluator's network. Throws a Failure.
splat_object_scores score_by_network(splat_evaluator evaluator, std::uint32_t object);

/// Score the objects of a shard under a progress bar. Throws a Failure.
ScoredObjects score_objects(splat_evaluator evaluator, const std::string& title, const Shard& shard,
                            const ScoreObject& score);

/// Throws a Failure if there are faults.
void check_finite(const ScoredObjects& scored);

}  // namespace vkrun

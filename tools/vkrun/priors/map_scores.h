#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/os/path.h"

namespace vkrun {

/// A score of a map.
struct MapMetric {
    const char* name;
    bool higher_is_better;
    int digits;  ///< shown behind the point
};

struct ScoreOptions {
    std::string kind = "depth";  ///< "depth", "normal", "mask" or "plane"
    bool published = false;
    bool half = false;  ///< the true mask is where alpha > 0.5
};

/// The scores of a kind; the first decides on wins and on the worst map.
const std::vector<MapMetric>& metrics_of(const std::string& kind);

/// The scores of one map, in that order; NaN: there is none. Throws a Failure of bad data.
std::vector<double> score_map(const std::filesystem::path& prediction,
                              const std::filesystem::path& truth, const ScoreOptions& options);

/// What the scores of a kind are, in sentences for a report.
std::string explain_scores(const ScoreOptions& options);

}  // namespace vkrun

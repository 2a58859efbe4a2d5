#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "vkrun/cli/json.h"
#include "vkrun/priors/map_files.h"
#include "vkrun/priors/map_scores.h"
#include "vkrun/priors/score_statistics.h"

namespace vkrun {

/// What `vkrun priors eval` found.
struct PriorsEvaluation {
    ScoreOptions options;
    std::string truth;
    std::vector<std::string> methods;  ///< folders
    std::vector<std::string> groups;   ///< may be empty
    std::vector<ScoredMap> maps;
    std::vector<std::string>
        problems;  ///< sentences: maps without a pair, or that cannot be scored
    MapFiles truth_files;
    std::vector<MapFiles> files;  ///< maps of each method
};

/// Tables on standard output.
void print_evaluation(const PriorsEvaluation& evaluation);

/// {"kind", "published", "truth", "maps", "methods": [{"path", "groups": [{"group", "metrics": {NAME: {"maps",
/// "mean", "median", "worst", "worst_map"}}}]}], "wins": [{"group", "metric", "maps", "by_method", "ties"}],
/// "problems"}; the group of all maps is null.
Json evaluation_json(const PriorsEvaluation& evaluation);

/// A line for each map and method.
std::string per_map_csv(const PriorsEvaluation& evaluation);

/// SVG of all scores: boxes for each, and dots of the first one.
std::string boxes_of(const PriorsEvaluation& evaluation);
std::string scatter_of(const PriorsEvaluation& evaluation);

/// The page of all this, with the worst maps.
std::string evaluation_page(const PriorsEvaluation& evaluation);

}  // namespace vkrun

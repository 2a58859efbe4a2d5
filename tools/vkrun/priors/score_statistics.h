#pragma once

#include <string>
#include <vector>

#include "vkrun/priors/map_scores.h"

namespace vkrun {

/// The scores of one map by all methods.
struct ScoredMap {
    std::string name;
    std::string group;
    std::vector<std::vector<double>> scores;  ///< [method][metric]; empty: not scored
};

/// Statistics over the maps that have the score; NaN without any.
struct ScoreStatistics {
    std::size_t maps = 0;
    double mean = 0, median = 0, worst = 0;
    std::string worst_map;
};

/// The scores that maps of a group (empty: of all) have.
std::vector<double> values_of(const std::vector<ScoredMap>& maps, const std::string& group,
                              std::size_t method, std::size_t metric);

ScoreStatistics statistics_of(const std::vector<ScoredMap>& maps, const std::string& group,
                              std::size_t method, std::size_t metric, bool higher_is_better);

/// Wins on the maps that all methods scored.
struct Wins {
    std::size_t maps = 0;
    std::vector<std::size_t> by_method;  ///< maps that only this one scored best on
    std::size_t ties = 0;
};

Wins wins_of(const std::vector<ScoredMap>& maps, const std::string& group, std::size_t methods,
             std::size_t metric, bool higher_is_better);

/// Quantile of sorted values, between neighbours by a straight line.
double quantile(const std::vector<double>& sorted, double share);

}  // namespace vkrun

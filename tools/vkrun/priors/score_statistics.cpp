#include "vkrun/priors/score_statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vkrun {
namespace {

bool in_group(const ScoredMap& map, const std::string& group) {
    return group.empty() || map.group == group;
}

/// NaN: none.
double score_of(const ScoredMap& map, std::size_t method, std::size_t metric) {
    return map.scores[method].empty() ? std::numeric_limits<double>::quiet_NaN()
                                      : map.scores[method][metric];
}

}  // namespace

std::vector<double> values_of(const std::vector<ScoredMap>& maps, const std::string& group,
                              std::size_t method, std::size_t metric) {
    std::vector<double> values;
    for (const ScoredMap& map : maps)
        if (in_group(map, group) && !std::isnan(score_of(map, method, metric)))
            values.push_back(score_of(map, method, metric));
    return values;
}

double quantile(const std::vector<double>& sorted, double share) {
    const double place = share * static_cast<double>(sorted.size() - 1);
    const auto low = static_cast<std::size_t>(place);
    const std::size_t high = std::min(low + 1, sorted.size() - 1);
    return sorted[low] + (place - static_cast<double>(low)) * (sorted[high] - sorted[low]);
}

ScoreStatistics statistics_of(const std::vector<ScoredMap>& maps, const std::string& group,
                              std::size_t method, std::size_t metric, bool higher_is_better) {
    std::vector<double> values = values_of(maps, group, method, metric);
    ScoreStatistics found;
    found.maps = values.size();
    if (values.empty()) {
        found.mean = found.median = found.worst = std::numeric_limits<double>::quiet_NaN();
        return found;
    }
    double sum = 0;
    for (const double value : values) sum += value;
    found.mean = sum / static_cast<double>(values.size());
    std::sort(values.begin(), values.end());
    found.median = quantile(values, 0.5);
    found.worst = higher_is_better ? values.front() : values.back();
    for (const ScoredMap& map : maps)
        if (in_group(map, group) && score_of(map, method, metric) == found.worst) {
            found.worst_map = map.name;
            break;
        }
    return found;
}

Wins wins_of(const std::vector<ScoredMap>& maps, const std::string& group, std::size_t methods,
             std::size_t metric, bool higher_is_better) {
    Wins wins;
    wins.by_method.resize(methods);
    for (const ScoredMap& map : maps) {
        if (!in_group(map, group)) continue;
        std::vector<double> scores(methods);
        for (std::size_t m = 0; m < methods; ++m)
            scores[m] = (higher_is_better ? -1 : 1) * score_of(map, m, metric);
        if (std::any_of(scores.begin(), scores.end(), [](double s) { return std::isnan(s); }))
            continue;
        ++wins.maps;
        const auto best = std::min_element(scores.begin(), scores.end());
        if (std::count(scores.begin(), scores.end(), *best) > 1)
            ++wins.ties;
        else
            ++wins.by_method[static_cast<std::size_t>(best - scores.begin())];
    }
    return wins;
}

}  // namespace vkrun

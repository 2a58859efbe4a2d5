#include "vkrun/priors/priors_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/os/path.h"
#include "vkrun/cli/html_page.h"
#include "vkrun/cli/table.h"
#include "vkrun/cli/text.h"
#include "vkrun/priors/score_plots.h"

namespace vkrun {
namespace {

constexpr std::size_t kWorstShown = 4;
constexpr std::uint32_t kWorstWidth = 160;  ///< pixels of the page

/// All maps first, then each group.
std::vector<std::string> groups_with_all(const PriorsEvaluation& evaluation) {
    std::vector<std::string> groups = {""};
    groups.insert(groups.end(), evaluation.groups.begin(), evaluation.groups.end());
    return groups;
}

std::string group_label(const std::string& group) {
    return group.empty() ? "all" : group;
}

std::string score_text(const MapMetric& metric, double value) {
    return std::isnan(value) ? "-" : format("%.*f", metric.digits, value);
}

std::string better_text(const MapMetric& metric) {
    return std::string(metric.name) + (metric.higher_is_better ? " (higher is better)" : "");
}

/// Rows of a table of one group, the heading first.
std::vector<std::vector<std::string>> score_rows(const PriorsEvaluation& evaluation,
                                                 const std::string& group) {
    std::vector<std::vector<std::string>> rows = {
        {"score", "method", ">maps", ">mean", ">median", ">worst", "worst map"}};
    const std::vector<MapMetric>& metrics = metrics_of(evaluation.options.kind);
    for (std::size_t k = 0; k < metrics.size(); ++k)
        for (std::size_t m = 0; m < evaluation.methods.size(); ++m) {
            const ScoreStatistics found =
                statistics_of(evaluation.maps, group, m, k, metrics[k].higher_is_better);
            rows.push_back({better_text(metrics[k]), evaluation.methods[m],
                            std::to_string(found.maps), score_text(metrics[k], found.mean),
                            score_text(metrics[k], found.median),
                            score_text(metrics[k], found.worst), found.worst_map});
        }
    return rows;
}

std::vector<std::vector<std::string>> win_rows(const PriorsEvaluation& evaluation,
                                               const std::string& group) {
    std::vector<std::vector<std::string>> rows = {{"best by", ">maps"}};
    for (const std::string& method : evaluation.methods) rows[0].push_back(">" + method);
    rows[0].emplace_back(">ties");
    const std::vector<MapMetric>& metrics = metrics_of(evaluation.options.kind);
    for (std::size_t k = 0; k < metrics.size(); ++k) {
        const Wins wins = wins_of(evaluation.maps, group, evaluation.methods.size(), k,
                                  metrics[k].higher_is_better);
        std::vector<std::string> row = {metrics[k].name, std::to_string(wins.maps)};
        for (const std::size_t count : wins.by_method) row.push_back(std::to_string(count));
        row.push_back(std::to_string(wins.ties));
        rows.push_back(std::move(row));
    }
    return rows;
}

std::string table_text(const std::vector<std::vector<std::string>>& rows) {
    Table table(rows[0]);
    for (std::size_t i = 1; i < rows.size(); ++i) table.add(rows[i]);
    return table.text();
}

Json number_json(double value) {
    return std::isnan(value) ? Json(nullptr) : Json(value);
}

Json group_json(const std::string& group) {
    return group.empty() ? Json(nullptr) : Json(group);
}

Json scores_json(const PriorsEvaluation& evaluation, const std::string& group, std::size_t method) {
    Json scores = Json::object();
    const std::vector<MapMetric>& metrics = metrics_of(evaluation.options.kind);
    for (std::size_t k = 0; k < metrics.size(); ++k) {
        const ScoreStatistics found =
            statistics_of(evaluation.maps, group, method, k, metrics[k].higher_is_better);
        scores[metrics[k].name] = {{"maps", found.maps},
                                   {"mean", number_json(found.mean)},
                                   {"median", number_json(found.median)},
                                   {"worst", number_json(found.worst)},
                                   {"worst_map", found.worst_map}};
    }
    return {{"group", group_json(group)}, {"metrics", scores}};
}

Json wins_json(const PriorsEvaluation& evaluation, const std::string& group) {
    Json list = Json::array();
    const std::vector<MapMetric>& metrics = metrics_of(evaluation.options.kind);
    for (std::size_t k = 0; k < metrics.size(); ++k) {
        const Wins wins = wins_of(evaluation.maps, group, evaluation.methods.size(), k,
                                  metrics[k].higher_is_better);
        list.push_back({{"group", group_json(group)},
                        {"metric", metrics[k].name},
                        {"maps", wins.maps},
                        {"by_method", wins.by_method},
                        {"ties", wins.ties}});
    }
    return list;
}

void add_worst(HtmlPage& page, const PriorsEvaluation& evaluation) {
    const MapMetric& metric = metrics_of(evaluation.options.kind)[0];
    std::vector<std::pair<double, const ScoredMap*>> order;
    for (const ScoredMap& map : evaluation.maps)
        if (!map.scores[0].empty() && !std::isnan(map.scores[0][0]))
            order.emplace_back((metric.higher_is_better ? 1 : -1) * map.scores[0][0], &map);
    std::stable_sort(order.begin(), order.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    if (order.empty()) return;
    page.heading("Worst maps of " + evaluation.methods[0]);
    const auto show = [&page](const std::filesystem::path& path, const std::string& caption) {
        if (path.extension() == ".png")
            page.picture(splat::os::text_of(path), caption, kWorstWidth);
    };
    for (std::size_t i = 0; i < std::min(kWorstShown, order.size()); ++i) {
        const ScoredMap& map = *order[i].second;
        page.paragraph(map.name);
        show(evaluation.truth_files.at(map.name), "truth");
        for (std::size_t m = 0; m < evaluation.methods.size(); ++m)
            if (!map.scores[m].empty())
                show(evaluation.files[m].at(map.name), evaluation.methods[m] + ": " + metric.name +
                                                           " " +
                                                           score_text(metric, map.scores[m][0]));
    }
}

}  // namespace

void print_evaluation(const PriorsEvaluation& evaluation) {
    std::printf("%s maps against %s: %zu. %s\n", evaluation.options.kind.c_str(),
                evaluation.truth.c_str(), evaluation.maps.size(),
                explain_scores(evaluation.options).c_str());
    for (const std::string& group : groups_with_all(evaluation)) {
        if (!evaluation.groups.empty()) std::printf("\nGroup: %s\n", group_label(group).c_str());
        std::printf("%s", table_text(score_rows(evaluation, group)).c_str());
        if (evaluation.methods.size() > 1)
            std::printf("\n%s", table_text(win_rows(evaluation, group)).c_str());
    }
}

Json evaluation_json(const PriorsEvaluation& evaluation) {
    Json methods = Json::array(), wins = Json::array();
    for (std::size_t m = 0; m < evaluation.methods.size(); ++m) {
        Json groups = Json::array();
        for (const std::string& group : groups_with_all(evaluation))
            groups.push_back(scores_json(evaluation, group, m));
        methods.push_back({{"path", evaluation.methods[m]}, {"groups", groups}});
    }
    if (evaluation.methods.size() > 1)
        for (const std::string& group : groups_with_all(evaluation))
            for (const Json& row : wins_json(evaluation, group)) wins.push_back(row);
    return {{"kind", evaluation.options.kind},
            {"published", evaluation.options.published},
            {"truth", evaluation.truth},
            {"maps", evaluation.maps.size()},
            {"methods", methods},
            {"wins", wins},
            {"problems", evaluation.problems}};
}

std::string per_map_csv(const PriorsEvaluation& evaluation) {
    const std::vector<MapMetric>& metrics = metrics_of(evaluation.options.kind);
    std::string csv = "map,group,method";
    for (const MapMetric& metric : metrics) csv += std::string(",") + metric.name;
    csv += "\n";
    for (const ScoredMap& map : evaluation.maps)
        for (std::size_t m = 0; m < evaluation.methods.size(); ++m) {
            if (map.scores[m].empty()) continue;
            csv += csv_field(map.name) + "," + csv_field(map.group) + "," +
                   csv_field(evaluation.methods[m]);
            for (const double score : map.scores[m])
                csv += std::isnan(score) ? "," : format(",%.9g", score);
            csv += "\n";
        }
    return csv;
}

std::string boxes_of(const PriorsEvaluation& evaluation) {
    std::vector<BoxPanel> panels;
    const std::vector<MapMetric>& metrics = metrics_of(evaluation.options.kind);
    for (std::size_t k = 0; k < metrics.size(); ++k) {
        BoxPanel panel{better_text(metrics[k]), {}};
        for (const std::string& group : groups_with_all(evaluation))
            for (std::size_t m = 0; m < evaluation.methods.size(); ++m)
                panel.rows.push_back({evaluation.methods[m] + (group.empty() ? "" : ", " + group),
                                      values_of(evaluation.maps, group, m, k), m});
        panels.push_back(std::move(panel));
    }
    return box_svg(panels);
}

std::string scatter_of(const PriorsEvaluation& evaluation) {
    const std::vector<MapMetric>& metrics = metrics_of(evaluation.options.kind);
    const bool alone = evaluation.methods.size() == 1;
    std::vector<ScatterPanel> panels;
    for (std::size_t m = alone ? 0 : 1; m < evaluation.methods.size(); ++m) {
        // One method: its first score against its second; else the first score of two methods.
        ScatterPanel panel{
            std::string(metrics[0].name) + " of " + evaluation.methods[0],
            std::string(metrics[alone ? 1 : 0].name) + " of " + evaluation.methods[m],
            {},
            !alone};
        for (const ScoredMap& map : evaluation.maps) {
            if (map.scores[0].empty() || map.scores[m].empty()) continue;
            const double x = map.scores[0][0], y = map.scores[m][alone ? 1 : 0];
            if (!std::isnan(x) && !std::isnan(y)) panel.points.emplace_back(x, y);
        }
        panels.push_back(std::move(panel));
    }
    return scatter_svg(panels);
}

std::string evaluation_page(const PriorsEvaluation& evaluation) {
    HtmlPage page("Scores of " + evaluation.options.kind + " maps");
    page.paragraph(explain_scores(evaluation.options));
    std::vector<std::pair<std::string, std::string>> facts = {
        {"truth", evaluation.truth}, {"maps", std::to_string(evaluation.maps.size())}};
    for (const std::string& method : evaluation.methods) facts.emplace_back("method", method);
    page.facts(facts);
    if (!evaluation.problems.empty()) {
        page.heading("Problems");
        for (const std::string& problem : evaluation.problems) page.paragraph(problem);
    }
    for (const std::string& group : groups_with_all(evaluation)) {
        const bool several = evaluation.methods.size() > 1;
        page.heading((several ? "Scores and wins, " : "Scores, ") + group_label(group));
        page.table(score_rows(evaluation, group));
        if (several) page.table(win_rows(evaluation, group));
    }
    page.heading("Distributions");
    page.plot(boxes_of(evaluation),
              "red: median; box: quartiles; line: to the farthest maps within 1.5 lengths of the "
              "box; dots: maps beyond");
    page.plot(scatter_of(evaluation), evaluation.methods.size() > 1
                                          ? "a dot for each map; red: where both are equal"
                                          : "a dot for each map");
    add_worst(page, evaluation);
    return page.text();
}

}  // namespace vkrun

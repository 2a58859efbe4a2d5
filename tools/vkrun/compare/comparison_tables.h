#pragma once

#include <splat.h>

#include <string>
#include <vector>

#include "vkrun/cli/json.h"

namespace vkrun {

/// B against A in one metric.
struct ComparedMetric {
    std::string metric, verdict;  ///< their names
    splat_metric_comparison found;
};

/// All metrics of a comparison, of which `report` is the library's.
std::vector<ComparedMetric> compared_metrics(splat_comparison comparison, const Json& report);

/// Methods against one baseline, for a publication.
struct ComparisonTable {
    struct Row {
        std::string method;
        ComparedMetric compared;
    };
    std::string baseline;
    bool paired = true;
    std::uint32_t permutations = 0, bootstraps = 0;
    std::size_t metrics = 0;  ///< p is corrected for their number
    std::vector<Row> rows;

    /// Add all metrics of a comparison with the baseline.
    void add(const std::string& method, const std::vector<ComparedMetric>& compared,
             const Json& report);
};

/// "exact", or "normal approximation with tie correction"; "-" where nothing is paired.
std::string rank_test_name(const splat_metric_comparison& found);

/// "12 : 3 : 5"; "-" where nothing was counted.
std::string wins_text(std::uint64_t wins, std::uint64_t ties, std::uint64_t losses);

/// "+0.10000 to +0.30000"; "-" without an interval. `pattern` prints an end.
std::string interval_text(const char* pattern, double low, double high);

/// A line per method and metric: means, intervals, p, names of the tests, wins, verdict. RFC 4180; a number that is not
/// there is empty.
std::string comparison_csv(const ComparisonTable& table);

/// A table environment that needs no package. Its caption names intervals, tests and corrections.
std::string comparison_latex(const ComparisonTable& table);

}  // namespace vkrun

#pragma once

#include <string>
#include <vector>

#include "vkrun/compare/comparison_tables.h"

namespace vkrun {

/// Evaluations in the folders of runs, each against the first of them over the objects of both.
struct RunEvaluations {
    std::vector<ComparedMetric>
        first;              ///< the first with itself, for its means; empty without evaluations
    ComparisonTable table;  ///< the others, where they share objects with the first
    std::vector<std::string> notes;  ///< on objects left out, or too few
};

/// Compare RUN/eval/per_object.csv of all runs that have it. Throws a Failure for files that cannot be compared.
RunEvaluations compare_evaluations(const std::vector<std::string>& folders);

}  // namespace vkrun

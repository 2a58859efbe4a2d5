#pragma once

#include <string>
#include <vector>

#include "vkrun/train/run_evaluations.h"

namespace vkrun {

/// Write a page about training runs, as the help of 'vkrun report' says, to `out` or as report.html in
/// the first folder. The page of a training that goes on loads itself again. `compared` are the evaluations of
/// `folders`; null: they are compared here. Returns its path. Throws a Failure.
std::string write_run_report(const std::vector<std::string>& folders, const std::string& out,
                             bool running = false, const RunEvaluations* compared = nullptr);

}  // namespace vkrun

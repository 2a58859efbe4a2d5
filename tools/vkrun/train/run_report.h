#pragma once

#include <string>
#include <vector>

namespace vkrun {

/// A page about training runs, see the help of 'vkrun report'; at `out`, or as report.html in the first
/// folder. Returns its path. Throws a Failure.
std::string write_run_report(const std::vector<std::string>& folders, const std::string& out);

}  // namespace vkrun

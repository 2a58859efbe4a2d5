#pragma once

#include <string>
#include <vector>

namespace vkrun {

/// One panel: a histogram.
struct PlotPanel {
    std::string title;
    std::vector<double> values;
    double mark = 0;                     ///< a line, e.g. at a difference of 0
    double mean = 0, low = 0, high = 0;  ///< a line and a band
};

/// An SVG file of histograms below each other.
std::string distribution_svg(const std::string& title, const std::vector<PlotPanel>& panels);

}  // namespace vkrun

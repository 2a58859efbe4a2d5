#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace vkrun {

/// A panel of boxes, one row each: median, quartiles, whiskers to the farthest value within 1.5 of their
/// distance (Tukey), and all values beyond as dots.
struct BoxRow {
    std::string label;
    std::vector<double> values;
    std::size_t color = 0;  ///< rows of one number look alike
};
struct BoxPanel {
    std::string title;
    std::vector<BoxRow> rows;
};

/// An SVG file of the panels below each other.
std::string box_svg(const std::vector<BoxPanel>& panels);

/// A panel of dots. `equal`: both axes have one scale, and a line shows where x = y.
struct ScatterPanel {
    std::string x_label, y_label;
    std::vector<std::pair<double, double>> points;
    bool equal = false;
};

/// An SVG file of the panels beside each other.
std::string scatter_svg(const std::vector<ScatterPanel>& panels);

}  // namespace vkrun

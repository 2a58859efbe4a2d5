#include "vkrun/priors/score_plots.h"

#include <algorithm>
#include <iterator>

#include "vkrun/cli/svg.h"
#include "vkrun/cli/text.h"
#include "vkrun/priors/score_statistics.h"

namespace vkrun {
namespace {

constexpr double kBoxWidth = 960, kLabels = 240, kRow = 22, kTitle = 24, kAxis = 20, kEdge = 20;
constexpr double kScatterSide = 300, kScatterMargin = 50;
constexpr const char* kBoxColors[] = {"#c8d8e8", "#f4d5b5", "#cde5c5", "#e0cfe8"};
constexpr std::size_t kFewDots = 200;  ///< are drawn larger

std::string svg_of(double width, double height, const std::string& content) {
    return format(
               "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.0f\" height=\"%.0f\" "
               "viewBox=\"0 "
               "0 %.0f %.0f\" font-family=\"sans-serif\" font-size=\"11\">\n<rect width=\"100%%\" "
               "height=\"100%%\" fill=\"white\"/>\n",
               width, height, width, height) +
           content + "</svg>\n";
}

/// The end of a long label, such as a path.
std::string label_text(const std::string& label) {
    constexpr std::size_t kMost = 36;  // characters in kLabels pixels
    return label.size() <= kMost ? label : "..." + label.substr(label.size() - kMost + 3);
}

std::string line_svg(double x1, double y1, double x2, double y2, const char* color) {
    return format("<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"%s\"/>\n", x1, y1,
                  x2, y2, color);
}

std::string dot_svg(double x, double y, std::size_t dots) {
    return format("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"%g\" fill=\"#4878a8\" opacity=\"0.6\"/>\n",
                  x, y, dots < kFewDots ? 3.5 : 2.0);
}

/// From values to pixels.
class Scale {
  public:
    Scale(double low, double high, double first, double last)
        : low_(low), high_(high > low ? high : low + 1), first_(first), last_(last) {}
    [[nodiscard]] double operator()(double value) const {
        return first_ + (value - low_) / (high_ - low_) * (last_ - first_);
    }
    [[nodiscard]] double low() const { return low_; }
    [[nodiscard]] double high() const { return high_; }

  private:
    double low_, high_, first_, last_;
};

std::string box_of(std::vector<double> values, std::size_t color, const Scale& x, double y) {
    std::sort(values.begin(), values.end());
    const double first = quantile(values, 0.25), middle = quantile(values, 0.5),
                 third = quantile(values, 0.75);
    const double reach = 1.5 * (third - first);
    const auto inside = [&](double value) {
        return value >= first - reach && value <= third + reach;
    };
    const double low = *std::find_if(values.begin(), values.end(), inside);
    const double high = *std::find_if(values.rbegin(), values.rend(), inside);
    std::string svg = line_svg(x(low), y, x(high), y, "#444");
    svg += format(
        "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"12\" fill=\"%s\" "
        "stroke=\"#444\"/>\n",
        x(first), y - 6, std::max(0.5, x(third) - x(first)),
        kBoxColors[color % std::size(kBoxColors)]);
    svg += line_svg(x(middle), y - 6, x(middle), y + 6, "#c03020");
    for (const double value : values)
        if (!inside(value)) svg += dot_svg(x(value), y, values.size());
    return svg;
}

double panel_height(const BoxPanel& panel) {
    return kTitle + kRow * static_cast<double>(panel.rows.size()) + kAxis;
}

std::string panel_of(const BoxPanel& panel, double top) {
    std::vector<double> all;
    for (const auto& [label, values, color] : panel.rows)
        all.insert(all.end(), values.begin(), values.end());
    std::string svg = svg_text(kEdge, top + 16, "start", panel.title);
    if (all.empty()) return svg;
    const auto [low, high] = std::minmax_element(all.begin(), all.end());
    const Scale x(*low, *high, kLabels, kBoxWidth - kEdge);
    const double bottom = top + panel_height(panel) - kAxis;
    svg += line_svg(kLabels, bottom, kBoxWidth - kEdge, bottom, "#ccc");
    svg += svg_text(kLabels, bottom + 13, "start", format("%.4g", x.low()));
    svg += svg_text(kBoxWidth - kEdge, bottom + 13, "end", format("%.4g", x.high()));
    double y = top + kTitle + kRow / 2;
    for (const auto& [label, values, color] : panel.rows) {
        svg += svg_text(kLabels - 10, y + 4, "end", label_text(label));
        if (!values.empty()) svg += box_of(values, color, x, y);
        y += kRow;
    }
    return svg;
}

std::string panel_of(const ScatterPanel& panel, double left) {
    std::vector<double> xs, ys;
    for (const auto& [x, y] : panel.points) {
        xs.push_back(x);
        ys.push_back(y);
    }
    if (panel.equal) {
        xs.insert(xs.end(), ys.begin(), ys.end());
        ys = xs;
    }
    const double right = left + kScatterMargin + kScatterSide, bottom = kEdge + kScatterSide;
    std::string svg = svg_text((left + kScatterMargin + right) / 2, bottom + 30, "middle",
                               label_text(panel.x_label));
    svg += svg_text(left + kScatterMargin, kEdge - 6, "start", label_text(panel.y_label));
    svg += line_svg(left + kScatterMargin, bottom, right, bottom, "#888");
    svg += line_svg(left + kScatterMargin, kEdge, left + kScatterMargin, bottom, "#888");
    if (xs.empty()) return svg;
    const auto [x0, x1] = std::minmax_element(xs.begin(), xs.end());
    const auto [y0, y1] = std::minmax_element(ys.begin(), ys.end());
    const Scale x(*x0, *x1, left + kScatterMargin, right), y(*y0, *y1, bottom, kEdge);
    if (panel.equal) svg += line_svg(x(x.low()), y(y.low()), x(x.high()), y(y.high()), "#c03020");
    for (const auto& [px, py] : panel.points) svg += dot_svg(x(px), y(py), panel.points.size());
    svg += svg_text(left + kScatterMargin, bottom + 14, "start", format("%.4g", x.low()));
    svg += svg_text(right, bottom + 14, "end", format("%.4g", x.high()));
    svg += svg_text(left + kScatterMargin - 5, bottom, "end", format("%.4g", y.low()));
    svg += svg_text(left + kScatterMargin - 5, kEdge + 8, "end", format("%.4g", y.high()));
    return svg;
}

}  // namespace

std::string box_svg(const std::vector<BoxPanel>& panels) {
    std::string content;
    double top = 0;
    for (const BoxPanel& panel : panels) {
        content += panel_of(panel, top);
        top += panel_height(panel);
    }
    return svg_of(kBoxWidth, top, content);
}

std::string scatter_svg(const std::vector<ScatterPanel>& panels) {
    std::string content;
    const double step = kScatterSide + kScatterMargin + kEdge;
    for (std::size_t i = 0; i < panels.size(); ++i)
        content += panel_of(panels[i], step * static_cast<double>(i));
    return svg_of(step * static_cast<double>(panels.size()), kScatterSide + kEdge + 40, content);
}

}  // namespace vkrun

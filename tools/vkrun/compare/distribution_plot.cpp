#include "vkrun/compare/distribution_plot.h"

#include <algorithm>

#include "vkrun/cli/svg.h"
#include "vkrun/cli/text.h"

namespace vkrun {
namespace {

constexpr double kPlotWidth = 640;
constexpr double kPanel = 150;
constexpr double kMargin = 40;
constexpr std::size_t kBins = 40;

std::string line_at(double x, double top, const char* color) {
    return format(
        "<line x1=\"%.1f\" x2=\"%.1f\" y1=\"%.1f\" y2=\"%.1f\" stroke=\"%s\" "
        "stroke-width=\"1.5\"/>\n",
        x, x, top + 22, top + kPanel - 22, color);
}

std::string panel_svg(const PlotPanel& panel, double top) {
    double low = std::min(panel.mark, panel.low);
    double high = std::max(panel.mark, panel.high);
    for (const double value : panel.values) {
        low = std::min(low, value);
        high = std::max(high, value);
    }
    if (!(high > low)) high = low + 1;
    const auto x_of = [&](double value) {
        return kMargin + (value - low) / (high - low) * (kPlotWidth - 2 * kMargin);
    };
    std::vector<std::size_t> bins(kBins);
    for (const double value : panel.values) {
        const double place = (value - low) / (high - low) * kBins;
        ++bins[std::min(kBins - 1, static_cast<std::size_t>(place))];
    }
    const auto most =
        static_cast<double>(std::max<std::size_t>(1, *std::max_element(bins.begin(), bins.end())));
    const double floor = top + kPanel - 22;
    const double step = (kPlotWidth - 2 * kMargin) / kBins;
    std::string svg = svg_text(kMargin, top + 14, "start", panel.title);
    svg += format(
        "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" fill=\"#f5c26b\" "
        "opacity=\"0.6\"/>\n",
        x_of(panel.low), top + 22, std::max(0.5, x_of(panel.high) - x_of(panel.low)), kPanel - 44);
    for (std::size_t i = 0; i < kBins; ++i) {
        const double height = static_cast<double>(bins[i]) / most * (kPanel - 50);
        if (bins[i] != 0)
            svg += format(
                "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" fill=\"#4878a8\"/>\n",
                kMargin + static_cast<double>(i) * step, floor - height, step * 0.9, height);
    }
    svg += line_at(x_of(panel.mark), top, "#888888") + line_at(x_of(panel.mean), top, "#c03020");
    svg += svg_text(kMargin, floor + 14, "start", format("%.4g", low));
    svg += svg_text(kPlotWidth - kMargin, floor + 14, "end", format("%.4g", high));
    return svg;
}

}  // namespace

std::string distribution_svg(const std::string& title, const std::vector<PlotPanel>& panels) {
    const double height = 30 + kPanel * static_cast<double>(panels.size());
    std::string svg = format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.0f\" height=\"%.0f\" viewBox=\"0 0 "
        "%.0f %.0f\" "
        "font-family=\"sans-serif\" font-size=\"11\">\n<rect width=\"100%%\" height=\"100%%\" "
        "fill=\"white\"/>\n",
        kPlotWidth, height, kPlotWidth, height);
    svg += svg_text(kPlotWidth / 2, 18, "middle", title);
    for (std::size_t i = 0; i < panels.size(); ++i)
        svg += panel_svg(panels[i], 30 + kPanel * static_cast<double>(i));
    return svg + "</svg>\n";
}

}  // namespace vkrun

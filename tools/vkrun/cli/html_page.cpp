#include "vkrun/cli/html_page.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <tuple>
#include <utility>

#include "core/os/path.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/svg.h"
#include "vkrun/cli/text.h"

namespace vkrun {
namespace {

constexpr const char* kStyle = R"(
:root{color-scheme:light dark;--text:#222;--soft:#5a5a5a;--line:#ddd;--page:#fff;--plate:#fff}
@media(prefers-color-scheme:dark){:root{--text:#ddd;--soft:#a8a8a8;--line:#444;--page:#16181b;--plate:#f4f4f4}}
body{font:15px/1.5 system-ui,sans-serif;max-width:110em;margin:2em auto;padding:0 1em;color:var(--text);
  background:var(--page)}
h1{font-size:1.6em;overflow-wrap:anywhere}
h2{font-size:1.2em;margin-top:2em;border-bottom:1px solid var(--line);overflow-wrap:anywhere}
section{display:flow-root}
p{max-width:70em}
.note{border-left:.3em solid #e0a030;padding-left:.8em}
.table{overflow-x:auto;min-width:min(100%,22em);margin:0 0 1em}
.table:not(.facts){display:inline-block;max-width:calc(100% - 2em);min-width:0;margin-right:2em;vertical-align:top;
  background:linear-gradient(270deg,var(--page) 1.5em,transparent) 100%/3em 100% no-repeat local,
  linear-gradient(270deg,#8888,transparent) 100%/1em 100% no-repeat}
table{border-collapse:collapse}
td,th{padding:.2em .8em .2em 0;border-bottom:1px solid var(--line);text-align:left;vertical-align:top;
  font-variant-numeric:tabular-nums}
th{color:var(--soft);font-weight:600}
td.number,th.number{text-align:right}
.facts td{overflow-wrap:anywhere}
@media(min-width:40em){.facts th{white-space:nowrap}}
figure{display:inline-block;margin:0 1em .5em 0;vertical-align:top;max-width:100%}
figcaption{font-size:.85em;color:var(--soft)}
figure:not(.sheet,.plot,.chart) figcaption{width:0;min-width:100%;overflow-wrap:anywhere}
img{max-width:100%;height:auto;image-rendering:pixelated;border:1px solid var(--line);box-sizing:border-box}
svg{max-width:100%;height:auto}
.sheet{display:flow-root;min-width:min(100%,28em);margin-right:0}
.scroll{overflow-x:auto}
.save{white-space:nowrap;color:inherit}
@media print{.save{display:none}}
.sheet img{width:100%;max-width:72em;min-width:44em}
@media(min-width:52em){.sheet img{min-width:0}}
.plot svg{background:var(--plate);color:#222;max-width:none}
.chart{float:left;width:max(min(100%,26em),33.3% - 1em)}
.chart>svg{width:100%;overflow:visible}
.chart text{font:17px system-ui,sans-serif;fill:var(--soft)}
.chart line{stroke:var(--line)}
@media(max-width:40em){table{font-size:.85em}td,th{padding-right:.5em}
  .table:not(.facts){margin-right:0;max-width:100%}
  figure:not(.sheet,.plot,.chart){width:calc(50% - 1.4em)}}
)";

/// Pictures of at least this width are as wide as there is room, and scroll where there is little.
constexpr std::uint32_t kSheet = 600;

constexpr const char* kColors[] = {"#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e"};
constexpr const char* kDashes[] = {"none", "7 3", "2 3"};  // for further curves of the same colours

/// Pixels of a chart, and of a line of text in a file of it: the title above, the legend below.
constexpr double kChartHeight = 260, kFileTitle = 26;

/// A step of 1, 2 or 5 times a power of ten, about a fifth of the range.
double tick_step(double range) {
    const double raw = range / 5;
    const double power = std::pow(10.0, std::floor(std::log10(raw)));
    for (const double factor : {1.0, 2.0, 5.0})
        if (raw <= factor * power) return factor * power;
    return 10 * power;
}

/// From data to pixels.
struct Axes {
    static constexpr double kLeft = 60, kTop = 10, kWidth = 560, kHeight = 220;
    double x0 = 0, x1 = 1, y0 = 0, y1 = 1;

    explicit Axes(const std::vector<HtmlPage::Curve>& curves) {
        double inf = std::numeric_limits<double>::infinity();
        x0 = y0 = inf;
        x1 = y1 = -inf;
        for (const HtmlPage::Curve& curve : curves)
            for (const auto& [x, y] : curve.points) {
                x0 = std::min(x0, x);
                x1 = std::max(x1, x);
                y0 = std::min(y0, y);
                y1 = std::max(y1, y);
            }
        if (!apart(x0, x1)) x1 = x0 + std::max(1.0, 1e-3 * std::abs(x0));
        const double half = std::max(0.5, 1e-3 * std::abs(y0));
        if (!apart(y0, y1)) std::tie(y0, y1) = std::pair(y0 - half, y1 + half);
    }
    /// True if numbers have room for steps between them that floating point can make.
    static bool apart(double low, double high) {
        return high - low > 1e-9 * std::max(std::abs(low), std::abs(high));
    }
    [[nodiscard]] double x(double value) const { return kLeft + kWidth * (value - x0) / (x1 - x0); }
    [[nodiscard]] double y(double value) const {
        return kTop + kHeight * (1 - (value - y0) / (y1 - y0));
    }
};

std::string grid(const Axes& axes) {
    std::string text;
    const double dx = std::max(tick_step(axes.x1 - axes.x0), 1.0);  // steps, or objects
    const double dy = tick_step(axes.y1 - axes.y0);
    for (double v = std::ceil(axes.y0 / dy) * dy; v <= axes.y1; v += dy)
        text += format(
            "<line x1='%.1f' x2='%.1f' y1='%.1f' y2='%.1f'/>"
            "<text x='%.1f' y='%.1f' text-anchor='end'>%.6g</text>",
            Axes::kLeft, Axes::kLeft + Axes::kWidth, axes.y(v), axes.y(v), Axes::kLeft - 6,
            axes.y(v) + 4, std::abs(v) < dy / 1e6 ? 0 : v);
    for (double v = std::ceil(axes.x0 / dx) * dx; v <= axes.x1; v += dx)
        text += format("<text x='%.1f' y='%.1f' text-anchor='middle'>%.6g</text>", axes.x(v),
                       Axes::kTop + Axes::kHeight + 18, v);
    return text;
}

}  // namespace

std::string base64(const std::string& bytes) {
    constexpr const char* kLetters =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        std::uint32_t word = 0;
        for (std::size_t k = 0; k < 3; ++k)
            word = (word << 8U) |
                   (i + k < bytes.size() ? static_cast<std::uint8_t>(bytes[i + k]) : 0U);
        for (std::size_t k = 0; k < 4; ++k)
            text += i + k <= bytes.size() ? kLetters[(word >> (18 - 6 * k)) & 63U] : '=';
    }
    return text;
}

std::string image_tag(const std::string& path, const std::string& text, std::uint32_t width) {
    std::ifstream file(splat::os::path_of(path), std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(file)), {});
    if (bytes.empty()) return "";
    const char* const type = path.ends_with(".gif")    ? "gif"
                             : path.ends_with(".webp") ? "webp"
                                                       : "png";
    return std::string("<img src=\"data:image/") + type + ";base64," + base64(bytes) + "\"" +
           (width == 0 ? "" : format(" width=\"%u\"", width)) + " alt=\"" + xml_escaped(text) +
           "\">";
}

HtmlPage::HtmlPage(const std::string& title) : title_(title) {}

void HtmlPage::heading(const std::string& text) {
    body_ += "</section>\n<section><h2>" + xml_escaped(text) + "</h2>\n";
}

void HtmlPage::paragraph(const std::string& text) {
    body_ += "<p>" + xml_escaped(text) + "</p>\n";
}

void HtmlPage::note(const std::string& text) {
    body_ += "<p class=\"note\">Note: " + xml_escaped(text) + "</p>\n";
}

void HtmlPage::facts(const std::vector<std::pair<std::string, std::string>>& rows) {
    body_ += "<div class=\"table facts\"><table>\n";
    for (const auto& [name, value] : rows)
        body_ += "<tr><th>" + xml_escaped(name) + "</th><td>" + xml_escaped(value) + "</td></tr>\n";
    body_ += "</table></div>\n";
}

void HtmlPage::table(const std::vector<std::vector<std::string>>& rows) {
    body_ += "<div class=\"table\"><table>\n";
    for (std::size_t row = 0; row < rows.size(); ++row) {
        const std::string tag = row == 0 ? "th" : "td";
        body_ += "<tr>";
        for (std::size_t column = 0; column < rows[row].size(); ++column) {
            const bool flush_right = column < rows[0].size() && rows[0][column].starts_with('>');
            const std::string& cell = rows[row][column];
            body_ += "<" + tag + (flush_right ? " class=\"number\">" : ">") +
                     xml_escaped(row == 0 && flush_right ? cell.substr(1) : cell) + "</" + tag +
                     ">";
        }
        body_ += "</tr>\n";
    }
    body_ += "</table></div>\n";
}

void HtmlPage::picture(const std::string& path, const std::string& caption, std::uint32_t width) {
    const std::string image = image_tag(path, caption, width);
    if (image.empty()) return;
    body_ +=
        (width < kSheet ? "<figure>" + image
                        : "<figure class=\"sheet\"><div class=\"scroll\">" + image + "</div>") +
        "<figcaption>" + xml_escaped(caption) + "</figcaption></figure>\n";
}

std::string HtmlPage::save_link(const std::string& svg, const std::string& caption) {
    std::string name;
    for (const char c : caption.substr(0, 60)) {
        const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0;
        if (plain || (!name.empty() && name.back() != '_')) name += plain ? c : '_';
    }
    return format(" <a class=\"save\" download=\"%u_%s.svg\" href=\"data:image/svg+xml;base64,",
                  ++figures_, name.c_str()) +
           base64(svg) + "\">Save as SVG</a>";
}

void HtmlPage::plot(const std::string& svg, const std::string& caption) {
    body_ += "<figure class=\"plot\"><div class=\"scroll\">" + svg + "</div><figcaption>" +
             xml_escaped(caption) + save_link(svg, caption) + "</figcaption></figure>\n";
}

void HtmlPage::chart(const std::string& caption, const std::vector<Curve>& curves) {
    if (std::all_of(curves.begin(), curves.end(), [](const Curve& c) { return c.points.empty(); }))
        return;
    const Axes axes(curves);
    std::string drawn = grid(axes), legend, below;  // the legend of the page, of the saved file
    double height = kFileTitle + kChartHeight;
    for (std::size_t i = 0; i < curves.size(); ++i) {
        const auto& points = curves[i].points;
        if (points.empty()) continue;
        const char* const color = kColors[i % std::size(kColors)];
        const char* const dashes = kDashes[i / std::size(kColors) % std::size(kDashes)];
        drawn += format(
            "<polyline fill='none' stroke-width='1.5' stroke='%s' stroke-dasharray='%s' "
            "points='",
            color, dashes);
        for (const auto& [x, y] : points) drawn += format("%.1f,%.1f ", axes.x(x), axes.y(y));
        drawn += "'/>";
        if (points.size() == 1)
            drawn += format("<circle r='3' fill='%s' cx='%.1f' cy='%.1f'/>", color,
                            axes.x(points[0].first), axes.y(points[0].second));
        if (curves.size() == 1) continue;
        const std::string sample =
            format(" stroke-width='3' style='stroke:%s' stroke-dasharray='%s'/>", color, dashes);
        legend +=
            " <span style='display:inline-block'><svg width='24' height='8' viewBox='0 0 24 8'>"
            "<line x2='24' y1='4' y2='4'" +
            sample + "</svg>&nbsp;" + xml_escaped(curves[i].name) + "</span>";
        height += kFileTitle;
        below += format("<line x1='60' x2='84' y1='%.0f' y2='%.0f'", height - 14, height - 14) +
                 sample + svg_text(92, height - 8, "start", curves[i].name);
    }
    const std::string file =
        format(
            "<svg xmlns='http://www.w3.org/2000/svg' width='640' height='%.0f' "
            "viewBox='0 0 640 %.0f'><style>text{font:15px sans-serif;fill:#444}"
            "line{stroke:#ddd}</style><rect width='100%%' height='100%%' fill='white'/>",
            height, height) +
        svg_text(320, 18, "middle", caption) +
        format("<g transform='translate(0 %.0f)'>", kFileTitle) + drawn + "</g>" + below +
        "</svg>\n";
    body_ +=
        "<figure class='chart'><svg width='640' height='260' viewBox='0 0 640 260' "
        "role='img' aria-label=\"" +
        xml_escaped(caption) + "\">" + drawn + "</svg><figcaption>" + xml_escaped(caption) +
        legend + save_link(file, caption) + "</figcaption></figure>\n";
}

void HtmlPage::embed(const std::string& markup, const std::string& style,
                     const std::string& script) {
    body_ += markup;
    style_ = style;
    script_ = script;
}

std::string HtmlPage::text() const {
    // A view in full window is not thrown out of it.
    const std::string reload = reload_ == 0
                                   ? ""
                                   : format(
                                         "<script>setInterval(() => document.fullscreenElement || "
                                         "location.reload(), %u)</script><noscript><meta "
                                         "http-equiv=\"refresh\" content=\"%u\"></noscript>",
                                         1000 * reload_, reload_);
    const std::string script =
        script_.empty() ? "" : "<script>(() => {\"use strict\";\n" + script_ + "})();</script>\n";
    return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
           "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">"
           "<link rel=\"icon\" href=\"data:,\">" +
           reload + "<title>" + xml_escaped(title_) + "</title><style>" + kStyle + style_ +
           "</style></head><body>\n<h1>" + xml_escaped(title_) + "</h1>\n<section>" + body_ +
           "</section>\n" + script + "</body></html>\n";
}

}  // namespace vkrun

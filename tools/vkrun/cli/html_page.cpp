#include "vkrun/cli/html_page.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>

#include "vkrun/cli/files.h"
#include "vkrun/cli/svg.h"
#include "vkrun/cli/text.h"

namespace vkrun {
namespace {

constexpr const char* kStyle =
    "body{font:15px/1.5 system-ui,sans-serif;max-width:72em;margin:2em auto;padding:0 "
    "1em;color:#222}"
    "h1{font-size:1.6em}h2{font-size:1.2em;margin-top:2em;border-bottom:1px solid #ddd}"
    "table{border-collapse:collapse;margin:1em 0}td,th{padding:.2em .8em;border-bottom:1px solid "
    "#eee;"
    "text-align:left;font-variant-numeric:tabular-nums}th{color:#555;font-weight:600}"
    "td.number,th.number{text-align:right}"
    "figure{display:inline-block;margin:.5em 1em .5em 0;vertical-align:top}"
    "figcaption{font-size:.85em;color:#555}img{max-width:100%;image-rendering:pixelated;"
    "border:1px solid #ddd}svg text{font:12px system-ui,sans-serif;fill:#444}";

constexpr const char* kColors[] = {"#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e"};

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
        if (!(x1 > x0)) x1 = x0 + 1;
        if (!(y1 > y0)) y1 = y0 + 1;
    }
    [[nodiscard]] double x(double value) const { return kLeft + kWidth * (value - x0) / (x1 - x0); }
    [[nodiscard]] double y(double value) const {
        return kTop + kHeight * (1 - (value - y0) / (y1 - y0));
    }
};

std::string grid(const Axes& axes) {
    std::string text;
    const double dx = tick_step(axes.x1 - axes.x0), dy = tick_step(axes.y1 - axes.y0);
    for (double v = std::ceil(axes.y0 / dy) * dy; v <= axes.y1; v += dy)
        text += format(
            "<line x1='%.1f' x2='%.1f' y1='%.1f' y2='%.1f' stroke='#eee'/>"
            "<text x='%.1f' y='%.1f' text-anchor='end'>%.6g</text>",
            Axes::kLeft, Axes::kLeft + Axes::kWidth, axes.y(v), axes.y(v), Axes::kLeft - 6,
            axes.y(v) + 4, std::abs(v) < dy / 1e6 ? 0 : v);
    for (double v = std::ceil(axes.x0 / dx) * dx; v <= axes.x1; v += dx)
        text += format("<text x='%.1f' y='%.1f' text-anchor='middle'>%.6g</text>", axes.x(v),
                       Axes::kTop + Axes::kHeight + 18, v);
    return text;
}

}  // namespace

HtmlPage::HtmlPage(const std::string& title) : title_(title) {}

void HtmlPage::heading(const std::string& text) {
    body_ += "<h2>" + xml_escaped(text) + "</h2>\n";
}

void HtmlPage::paragraph(const std::string& text) {
    body_ += "<p>" + xml_escaped(text) + "</p>\n";
}

void HtmlPage::facts(const std::vector<std::pair<std::string, std::string>>& rows) {
    body_ += "<table>\n";
    for (const auto& [name, value] : rows)
        body_ += "<tr><th>" + xml_escaped(name) + "</th><td>" + xml_escaped(value) + "</td></tr>\n";
    body_ += "</table>\n";
}

void HtmlPage::table(const std::vector<std::vector<std::string>>& rows) {
    body_ += "<table>\n";
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
    body_ += "</table>\n";
}

void HtmlPage::picture(const std::string& path, const std::string& caption, std::uint32_t width) {
    std::ifstream file = open_to_read(path);
    const std::string bytes((std::istreambuf_iterator<char>(file)), {});
    if (bytes.empty()) return;
    const char* const type = path.ends_with(".gif") ? "gif" : "png";
    body_ += std::string("<figure><img src=\"data:image/") + type + ";base64," + base64(bytes) +
             "\"" + (width == 0 ? "" : format(" width=\"%u\"", width)) + " alt=\"" +
             xml_escaped(caption) + "\"><figcaption>" + xml_escaped(caption) +
             "</figcaption></figure>\n";
}

void HtmlPage::plot(const std::string& svg, const std::string& caption) {
    body_ += "<figure>" + svg + "<figcaption>" + xml_escaped(caption) + "</figcaption></figure>\n";
}

void HtmlPage::chart(const std::string& caption, const std::vector<Curve>& curves) {
    std::vector<Curve> shown;
    for (const Curve& curve : curves)
        if (!curve.points.empty()) shown.push_back(curve);
    if (shown.empty()) return;
    const Axes axes(shown);
    std::string svg = "<figure><svg width='640' height='260' viewBox='0 0 640 260'>" + grid(axes);
    for (std::size_t i = 0; i < shown.size(); ++i) {
        const char* const color = kColors[i % std::size(kColors)];
        svg +=
            std::string("<polyline fill='none' stroke-width='1.5' stroke='") + color + "' points='";
        for (const auto& [x, y] : shown[i].points)
            svg += format("%.1f,%.1f ", axes.x(x), axes.y(y));
        svg += format("'/><text x='%.1f' y='%.1f' text-anchor='end' style='fill:%s'>%s</text>",
                      Axes::kLeft + Axes::kWidth, Axes::kTop + 14 + 16 * static_cast<double>(i),
                      color, xml_escaped(shown[i].name).c_str());
    }
    body_ += svg + "</svg><figcaption>" + xml_escaped(caption) + "</figcaption></figure>\n";
}

std::string HtmlPage::text() const {
    return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>" +
           xml_escaped(title_) + "</title><style>" + kStyle + "</style></head><body>\n<h1>" +
           xml_escaped(title_) + "</h1>\n" + body_ + "</body></html>\n";
}

}  // namespace vkrun

// The rows of stress as a table, as JSON and as a plot.

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "stress/stress.h"
#include "vkrun/cli/svg.h"
#include "vkrun/cli/table.h"
#include "vkrun/cli/text.h"

namespace vkrun::stress {
namespace {

std::string figure(double value) {
    return std::isnan(value) ? "" : std::isinf(value) ? "not finite" : format("%.1e", value);
}

const char* verdict_of(const Verdict& verdict) {
    return verdict.passed() ? "PASS" : "FAIL";
}

/// The row of each case that is nearest to its bound, and every row that fails, in the order of the rows.
std::vector<const Row*> shown(const std::vector<Row>& rows) {
    std::map<std::string, const Row*> worst;
    for (const Row& row : rows) {
        const Row*& most = worst[row.group + "/" + row.name];
        if (most == nullptr || row.verdict.ratio() > most->verdict.ratio()) most = &row;
    }
    std::vector<const Row*> chosen;
    for (const Row& row : rows)
        if (!row.verdict.passed() || worst.at(row.group + "/" + row.name) == &row)
            chosen.push_back(&row);
    return chosen;
}

/// The reasons in the order of the rows; each row names its reason by number.
std::vector<std::string> reasons_of(const std::vector<Row>& rows) {
    std::vector<std::string> reasons;
    for (const Row& row : rows)
        if (std::find(reasons.begin(), reasons.end(), row.reason) == reasons.end())
            reasons.push_back(row.reason);
    return reasons;
}

/// A logarithmic axis of error / allowed, cut at both ends.
constexpr double kLeast = 1e-6, kMost = 1e3;

double place(double ratio) {
    const double cut = std::clamp(ratio, kLeast, kMost);
    return (std::log10(cut) - std::log10(kLeast)) / (std::log10(kMost) - std::log10(kLeast));
}

/// The first part of a name: an operator, or a family of scenes.
std::string family_of(const Row& row) {
    return row.group + " " + row.name.substr(0, row.name.find('/'));
}

const char* color_of(const Row& row) {
    if (!row.verdict.passed()) return "#e15759";
    return row.kernels == "plain" ? "#4e79a7" : row.kernels == "cpu" ? "#59a14f" : "#b07aa1";
}

}  // namespace

std::string stress_table(const std::vector<Row>& rows) {
    const std::vector<std::string> reasons = reasons_of(rows);
    Table table({"  case", "input", "result", "kernels", ">error", ">allowed", ">why", ">peer",
                 ">non-finite", ">wrong", "verdict", "reproduce"});
    std::size_t failed = 0;
    for (const Row& row : rows) failed += row.verdict.passed() ? 0 : 1;
    for (const Row* row : shown(rows)) {
        const auto why = std::find(reasons.begin(), reasons.end(), row->reason) - reasons.begin();
        table.add({"  " + row->group + "/" + row->name, row->input, row->result, row->kernels,
                   figure(row->verdict.error), figure(row->verdict.allowed),
                   format("[%d]", static_cast<int>(why) + 1), figure(row->peer),
                   format("%zu", row->verdict.non_finite), format("%zu", row->verdict.wrong),
                   std::string(verdict_of(row->verdict)) +
                       (row->verdict.unequal > 0 ? " (bits)" : "") +
                       (row->verdict.unjudged > 0 ? " (no reference)" : ""),
                   row->reproduce()});
    }
    std::string text = table.text() + "\nAllowed:\n";
    for (std::size_t i = 0; i < reasons.size(); ++i)
        text += format("  [%zu] %s\n", i + 1, reasons[i].c_str());
    return text + format("%zu results, %zu FAIL\n", rows.size(), failed);
}

Json stress_json(const std::vector<Row>& rows) {
    Json json = Json::array();
    for (const Row& row : rows) {
        Json one{{"case", row.group + "/" + row.name},
                 {"input", row.input},
                 {"result", row.result},
                 {"kernels", row.kernels},
                 {"error", row.verdict.error},
                 {"allowed", row.verdict.allowed},
                 {"reason", row.reason},
                 {"peer", nullptr},
                 {"elements", row.verdict.elements},
                 {"non_finite", row.verdict.non_finite},
                 {"wrong", row.verdict.wrong},
                 {"unequal_bits", row.verdict.unequal},
                 {"passed", row.verdict.passed()},
                 {"reproduce", row.reproduce()}};
        if (std::isfinite(row.peer)) one["peer"] = row.peer;
        if (std::isinf(row.peer)) one["peer"] = "not finite";
        json.push_back(std::move(one));
    }
    return json;
}

std::string stress_svg(const std::vector<Row>& rows, const std::string& title) {
    constexpr double kLeft = 190, kTop = 50, kWidth = 560, kLine = 16;
    std::vector<std::string> families;
    for (const Row& row : rows)
        if (std::find(families.begin(), families.end(), family_of(row)) == families.end())
            families.push_back(family_of(row));
    const double height = kLine * static_cast<double>(families.size());
    const auto at_x = [&](double ratio) { return kLeft + kWidth * place(ratio); };
    std::string svg = format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%g\" height=\"%g\" "
        "font-family=\"sans-serif\" font-size=\"12\">\n"
        "<rect width=\"100%%\" height=\"100%%\" fill=\"white\"/>\n"
        "<rect x=\"%g\" y=\"%g\" width=\"%g\" height=\"%g\" fill=\"none\" stroke=\"#999\"/>\n",
        kLeft + kWidth + 60, kTop + height + 64, kLeft, kTop, kWidth, height);
    svg += svg_text(10, 24, "start", title);
    for (int power = -6; power <= 3; ++power) {
        const double x = at_x(std::pow(10, power));
        svg += format("<line x1=\"%.1f\" x2=\"%.1f\" y1=\"%g\" y2=\"%g\" stroke=\"%s\"/>\n", x, x,
                      kTop, kTop + height, power == 0 ? "#e15759" : "#ddd");
        svg += svg_text(x, kTop + height + 18, "middle",
                        power == -6  ? "exact"
                        : power == 3 ? "not finite"
                                     : format("%g", std::pow(10, power)));
    }
    svg += svg_text(kLeft + kWidth / 2, kTop + height + 36, "middle",
                    "error over the allowed error; beyond 1 is a FAIL");
    const char* names[] = {"plain", "cpu", "gpu", "FAIL", "float32 elsewhere"};
    const char* colors[] = {"#4e79a7", "#59a14f", "#b07aa1", "#e15759", "#bbb"};
    for (std::size_t i = 0; i < 5; ++i) {
        const double x = kLeft + 110 * static_cast<double>(i);
        svg += format("<circle cx=\"%g\" cy=\"%g\" r=\"4\" fill=\"%s\"/>\n", x, kTop + height + 52,
                      colors[i]);
        svg += svg_text(x + 8, kTop + height + 56, "start", names[i]);
    }
    for (std::size_t i = 0; i < families.size(); ++i)
        svg +=
            svg_text(kLeft - 8, kTop + kLine * (static_cast<double>(i) + 0.75), "end", families[i]);
    // Each colour's dots are one path: points at which a round pen is set down, on whole pixels, each once.
    std::map<std::string, std::set<std::pair<int, int>>> dots;
    const auto dot = [&](const Row& row, double ratio, const char* color) {
        const auto line = std::find(families.begin(), families.end(), family_of(row));
        const auto place_of = static_cast<double>(line - families.begin());
        dots[color].insert({static_cast<int>(std::lround(kTop + kLine * (place_of + 0.5))),
                            static_cast<int>(std::lround(at_x(ratio)))});
    };
    for (const Row& row : rows) {
        if (!std::isnan(row.peer) && row.verdict.allowed > 0)
            dot(row, std::min(row.peer / row.verdict.allowed, kMost), colors[4]);
        dot(row, std::min(row.verdict.ratio(), kMost), color_of(row));
    }
    for (const int i : {4, 0, 1, 2, 3}) {
        if (dots[colors[i]].empty()) continue;
        svg += format("<path stroke=\"%s\" stroke-width=\"%d\" stroke-linecap=\"round\" d=\"",
                      colors[i], i == 3 ? 8 : 5 - i / 4);
        for (const auto& [y, x] : dots[colors[i]]) svg += format("M%d %dh0", x, y);
        svg += "\"/>\n";
    }
    return svg + "</svg>\n";
}

}  // namespace vkrun::stress

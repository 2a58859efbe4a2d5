// The figures of the rasterizer's benchmark as a table, JSON, CSV and SVG.

#include <algorithm>
#include <array>

#include "bench/raster/raster_bench.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/svg.h"
#include "vkrun/cli/table.h"
#include "vkrun/cli/text.h"

namespace vkrun::bench {
namespace {

constexpr double kTilePixels = 256;

struct Row {
    const RasterFigures* figures;
    const RasterTimes* times;
    const char* direction;

    [[nodiscard]] bool forward() const { return times != &figures->backward; }
    [[nodiscard]] std::string stage(const char* name) const {
        return std::string(name) + (forward() ? "_forward" : "_backward");
    }
};

std::vector<Row> rows_of(const RasterMeasurement& m) {
    std::vector<Row> rows;
    for (const RasterFigures* figures : {&m.plain, &m.fast}) {
        if (figures->kernels.empty()) continue;
        rows.push_back({figures, &figures->render, "render"});
        rows.push_back({figures, &figures->forward, "forward"});
        rows.push_back({figures, &figures->backward, "backward"});
    }
    return rows;
}

double stage(const RasterTimes& times, const std::string& name) {
    const auto at = times.stage_ms.find(name);
    return at == times.stage_ms.end() ? 0 : at->second;
}

/// Nanoseconds of blending per pixel of a tile and entry of its list.
double blend_ns(const Row& row) {
    const double pairs = row.figures->mean_pairs * kTilePixels;
    return pairs == 0 ? 0 : stage(*row.times, row.stage("blend")) / pairs * 1e6;
}

Json times_json(const Row& row) {
    Json json;
    json["min_ms"] = row.times->min_ms();
    json["median_ms"] = row.times->median_ms();
    json["calls"] = row.times->wall_ms.size();
    json["blend_ns_per_pair"] = blend_ns(row);
    json["stages_ms"] = row.times->stage_ms;
    return json;
}

Json figures_json(const RasterFigures& figures) {
    Json json;
    json["kernels"] = figures.kernels;
    json["render"] = times_json({&figures, &figures.render, "render"});
    json["forward"] = times_json({&figures, &figures.forward, "forward"});
    json["backward"] = times_json({&figures, &figures.backward, "backward"});
    json["max_rgb_error"] = figures.error.max_rgb;
    json["typical_rgb_error"] = figures.error.typical_rgb;
    json["max_gradient_error"] = figures.error.max_gradient;
    json["visible"] = figures.info.visible;
    json["pairs"] = figures.info.pairs;
    json["longest_list"] = figures.info.longest;
    json["empty_tiles"] = figures.info.empty_tiles;
    json["tiles"] = figures.info.tiles;
    json["bytes"] = figures.info.bytes;
    json["passes"] = figures.info.passes;
    return json;
}

const char* direction_of(const SkipFigures& skip) {
    return skip.backward ? "backward" : "forward";
}

/// The columns of the table that are stages, in its order.
std::array<double, 4> stages_of(const Row& row) {
    return {stage(*row.times, row.stage("project")), stage(*row.times, "radix_sort"),
            stage(*row.times, "tile_bin") + stage(*row.times, "tile_ranges"),
            stage(*row.times, row.stage("blend"))};
}

/// A cell of a CSV file.
std::string quoted(const std::string& text) {
    if (text.find_first_of(",\"\n") == std::string::npos) return text;
    std::string cell = "\"";
    for (const char c : text) cell += c == '"' ? "\"\"" : std::string(1, c);
    return cell + "\"";
}

/// The first cells of every row of the CSV file.
std::string csv_scene(const RasterMeasurement& m) {
    return quoted(m.title) + format(",%llu,%u,%u,%zu", static_cast<unsigned long long>(m.gaussians),
                                    m.width, m.height, m.views);
}

/// Bars of the time without each skip, with the time with it inside.
std::string svg_skips(const RasterMeasurement& m, double left, double width, double row_height,
                      double y) {
    double longest = 0;
    for (const SkipFigures& skip : m.skips) longest = std::max({longest, skip.ms, skip.with_ms});
    std::string text;
    for (const SkipFigures& skip : m.skips) {
        const double scale = longest > 0 ? width / longest : 0;
        text += format("<text x=\"10\" y=\"%g\">%s without %s</text>\n", y + 16, direction_of(skip),
                       xml_escaped(skip.name).c_str());
        text += format(
            "<rect x=\"%.1f\" y=\"%g\" width=\"%.1f\" height=\"22\" fill=\"#bab0ac\"/>\n"
            "<rect x=\"%.1f\" y=\"%g\" width=\"%.1f\" height=\"8\" fill=\"#4e79a7\"/>\n",
            left, y, skip.ms * scale, left, y + 7, skip.with_ms * scale);
        text += format("<text x=\"%.1f\" y=\"%g\">%.1f ms, with it %.1f ms</text>\n",
                       left + std::max(skip.ms, skip.with_ms) * scale + 6, y + 16, skip.ms,
                       skip.with_ms);
        y += row_height;
    }
    return text;
}

}  // namespace

Json raster_json(const RasterMeasurement& m) {
    Json json;
    json["scene"] = m.title;
    json["gaussians"] = m.gaussians;
    json["width"] = m.width;
    json["height"] = m.height;
    json["views"] = m.views;
    if (!m.plain.kernels.empty()) json["plain"] = figures_json(m.plain);
    json["fast"] = figures_json(m.fast);
    json["skips"] = Json::array();
    for (const SkipFigures& skip : m.skips)
        json["skips"].push_back({{"without", skip.name},
                                 {"direction", direction_of(skip)},
                                 {"ms", skip.ms},
                                 {"with_ms", skip.with_ms},
                                 {"max_difference", skip.max_difference},
                                 {"max_error", skip.error},
                                 {"with_max_error", skip.with_error},
                                 {"pairs", skip.pairs},
                                 {"with_pairs", skip.with_pairs},
                                 {"visible", skip.visible}});
    json["all_pairs"] = m.all_pairs();
    if (m.fewest_pairs > 0) json["fewest_pairs"] = m.fewest_pairs;
    return json;
}

std::string raster_table(const RasterMeasurement& m) {
    std::string text = format(
        "%s: %llu Gaussians, %u x %u, %zu views; %llu visible, %llu pairs, longest list %llu, "
        "%llu of %llu tiles empty, %s, %u passes\n",
        m.title.c_str(), static_cast<unsigned long long>(m.gaussians), m.width, m.height, m.views,
        static_cast<unsigned long long>(m.fast.info.visible),
        static_cast<unsigned long long>(m.fast.info.pairs),
        static_cast<unsigned long long>(m.fast.info.longest),
        static_cast<unsigned long long>(m.fast.info.empty_tiles),
        static_cast<unsigned long long>(m.fast.info.tiles), bytes_text(m.fast.info.bytes).c_str(),
        m.fast.info.passes);
    Table table({"  direction", "kernels", ">min ms", ">median ms", ">project", ">sort", ">bin",
                 ">blend", ">ns/pair", ">typical error", ">max error"});
    for (const Row& row : rows_of(m)) {
        const auto [project, sort, bin, blend] = stages_of(row);
        table.add({std::string("  ") + row.direction, row.figures->kernels,
                   format("%.2f", row.times->min_ms()), format("%.2f", row.times->median_ms()),
                   format("%.2f", project), format("%.2f", sort), format("%.2f", bin),
                   format("%.2f", blend), format("%.3f", blend_ns(row)),
                   row.forward() ? format("%.1e", row.figures->error.typical_rgb) : "",
                   format("%.1e", row.forward() ? row.figures->error.max_rgb
                                                : row.figures->error.max_gradient)});
    }
    text += table.text();
    Table skips({"  direction", "without", ">min ms", ">with ms", ">ratio", ">pairs", ">visible",
                 ">max difference", ">max error", ">with error"});
    for (const SkipFigures& skip : m.skips)
        skips.add({std::string("  ") + direction_of(skip), skip.name, format("%.2f", skip.ms),
                   format("%.2f", skip.with_ms), format("%.2f", skip.ms / skip.with_ms),
                   format("%llu", static_cast<unsigned long long>(skip.pairs)),
                   format("%llu", static_cast<unsigned long long>(skip.visible)),
                   format("%.1e", skip.max_difference), format("%.1e", skip.error),
                   format("%.1e", skip.with_error)});
    text += skips.text();
    if (m.fewest_pairs > 0)
        text += format("  all views: %llu pairs; a pixel sees the Gaussian in %llu of them\n",
                       static_cast<unsigned long long>(m.all_pairs()),
                       static_cast<unsigned long long>(m.fewest_pairs));
    return text;
}

std::string raster_csv(const RasterMeasurement& m) {
    std::string text =
        "scene,gaussians,width,height,views,kernels,direction,without,min_ms,with_ms,median_ms,"
        "calls,project_ms,sort_ms,bin_ms,blend_ms,blend_ns_per_pair,typical_error,max_error,"
        "with_max_error,max_difference,visible,pairs,with_pairs,longest_list,empty_tiles,tiles,"
        "bytes,passes,fewest_pairs\n";
    const std::string scene = csv_scene(m);
    const auto count = [](std::uint64_t n) {
        return format("%llu", static_cast<unsigned long long>(n));
    };
    const std::string fewest = m.fewest_pairs > 0 ? count(m.fewest_pairs) : "";
    for (const Row& row : rows_of(m)) {
        const RasterFigures& f = *row.figures;
        const auto [project, sort, bin, blend] = stages_of(row);
        text += scene + "," + f.kernels + "," + row.direction +
                format(",,%.4f,,%.4f,%zu,%.4f,%.4f,%.4f,%.4f,%.4f,", row.times->min_ms(),
                       row.times->median_ms(), row.times->wall_ms.size(), project, sort, bin, blend,
                       blend_ns(row));
        text += row.forward() ? format("%.3g,%.3g", f.error.typical_rgb, f.error.max_rgb)
                              : format(",%.3g", f.error.max_gradient);
        text += ",,," + count(f.info.visible) + "," + count(f.info.pairs) + ",," +
                count(f.info.longest) + "," + count(f.info.empty_tiles) + "," +
                count(f.info.tiles) + "," + count(f.info.bytes) + "," + count(f.info.passes) + "," +
                fewest + "\n";
    }
    for (const SkipFigures& skip : m.skips)
        text += scene + "," + m.fast.kernels + "," + direction_of(skip) + "," + skip.name +
                format(",%.4f,%.4f,,,,,,,,,%.3g,%.3g,%.3g,", skip.ms, skip.with_ms, skip.error,
                       skip.with_error, skip.max_difference) +
                count(skip.visible) + "," + count(skip.pairs) + "," + count(skip.with_pairs) +
                ",,,,,," + fewest + "\n";
    return text;
}

std::string raster_svg(const RasterMeasurement& m) {
    constexpr double kLeft = 200;
    constexpr double kWidth = 600;
    constexpr double kRowHeight = 34;
    constexpr std::array<const char*, 6> kColors = {"#4e79a7", "#f28e2b", "#59a14f",
                                                    "#e15759", "#b07aa1", "#9c755f"};
    const std::vector<Row> rows = rows_of(m);
    double longest = 0;
    for (const Row& row : rows) {
        double sum = 0;
        for (const auto& [name, ms] : row.times->stage_ms) sum += ms;
        longest = std::max(longest, sum);
    }
    const double height = 60 + kRowHeight * static_cast<double>(rows.size() + m.skips.size());
    std::string text = format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%g\" height=\"%g\" "
        "font-family=\"sans-serif\" font-size=\"12\">\n<text x=\"10\" y=\"20\">%s, %u x %u: "
        "device time by stage</text>\n",
        kLeft + kWidth + 180, height, xml_escaped(m.title).c_str(), m.width, m.height);
    double y = 36;
    for (const Row& row : rows) {
        text += format("<text x=\"10\" y=\"%g\">%s %s</text>\n", y + 16,
                       row.figures->kernels.c_str(), row.direction);
        double x = kLeft;
        std::size_t color = 0;
        for (const auto& [name, ms] : row.times->stage_ms) {
            const double width = longest > 0 ? kWidth * ms / longest : 0;
            text += format(
                "<rect x=\"%.1f\" y=\"%g\" width=\"%.1f\" height=\"22\" fill=\"%s\">"
                "<title>%s: %.2f ms</title></rect>\n",
                x, y, width, kColors[color++ % kColors.size()], name.c_str(), ms);
            x += width;
        }
        text += format("<text x=\"%.1f\" y=\"%g\">%.1f ms</text>\n", x + 6, y + 16,
                       row.times->min_ms());
        y += kRowHeight;
    }
    return text + svg_skips(m, kLeft, kWidth, kRowHeight, y) + "</svg>\n";
}

}  // namespace vkrun::bench

// Run time against error, over every precision, set of kernels and skip.

#include <algorithm>
#include <cmath>

#include "stress/network.h"
#include "stress/network_run.h"
#include "stress/raster_run.h"
#include "stress/raster_scenes.h"
#include "stress/stress.h"
#include "vkrun/cli/stopwatch.h"
#include "vkrun/cli/svg.h"
#include "vkrun/cli/text.h"

namespace vkrun::stress {
namespace {

struct Point {
    std::string label;
    std::string kernels;
    double ms = 1e30;
    double error = 0;
};

/// ||got - expected|| / ||expected||
double relative_error(const std::vector<float>& got, const Numbers& expected) {
    double difference = 0;
    double norm = 0;
    for (std::size_t i = 0; i < got.size(); ++i) {
        const double error = static_cast<double>(got[i]) - expected[i];
        difference += error * error;
        norm += expected[i] * expected[i];
    }
    return std::sqrt(difference / norm);
}

template <class Pass>
double shortest_ms(int rounds, const Pass& pass) {
    double shortest = 1e30;
    pass();  // outside the figures: kernels and caches
    for (int i = 0; i < rounds; ++i) shortest = std::min(shortest, timed_ms(pass));
    return shortest;
}

std::vector<Point> network_points(const Run& run) {
    ResidualShape shape;
    shape.width = 32;
    shape.side = 16;
    Network net = residual_network(shape);
    const std::size_t y = tensor_named(net, "y");
    NetworkInDouble twin(net);
    twin.forward(nullptr);
    std::vector<Point> points;
    const char* const names[] = {"strict", "balanced", "fast"};
    for (const KernelDevice& with : run.devices())
        for (int precision = 1; precision <= 3; ++precision) {
            for (NetNode& node : net.nodes)
                if (node.op == "conv2d") node.attributes = {{"scale", 1}, {"precision", precision}};
            NetworkOnDevice on_device(with.device.get(), net);
            Point point{names[precision - 1], with.kernels};
            point.ms = shortest_ms(10, [&] { on_device.forward(); });
            point.error = relative_error(on_device.value(y), twin.values[y]);
            points.push_back(point);
        }
    return points;
}

struct Skip {
    const char* without;
    std::uint32_t bit;
};
constexpr Skip kSkips[] = {{"all skips", 0},
                           {"no opacity extent", SPLAT_SKIP_OPACITY_EXTENT},
                           {"no exact tiles", SPLAT_SKIP_EXACT_TILES},
                           {"no cull", SPLAT_SKIP_CULL},
                           {"no early out", SPLAT_SKIP_EARLY_OUT},
                           {"no blocks", SPLAT_SKIP_BLOCKS}};

std::vector<Point> raster_points(const Run& run) {
    const RasterScene scene = bench_scene();
    const Numbers expected = splat::ref::rasterize_forward(scene).rgb;
    std::vector<Point> points;
    for (const KernelDevice& with : run.devices())
        for (const Skip& skip : kSkips) {
            RasterOnDevice on_device(with.device.get(), scene, {}, skip.bit);
            Point point{skip.without, with.kernels};
            point.ms = shortest_ms(10, [&] { on_device.forward(); });
            point.error =
                relative_error(on_device.output(SPLAT_OUTPUT_RGB, expected.size()), expected);
            points.push_back(point);
        }
    return points;
}

constexpr double kLeft = 80, kTop = 60, kWidth = 520, kHeight = 230;

/// The range of a logarithmic axis, a little wider than the values.
struct Range {
    double low, high;

    template <class Get>
    Range(const std::vector<Point>& points, const Get& get) {
        const auto less = [&](const Point& a, const Point& b) { return get(a) < get(b); };
        low = std::log10(get(*std::min_element(points.begin(), points.end(), less)) / 1.5);
        high = std::log10(get(*std::max_element(points.begin(), points.end(), less)) * 1.5);
    }
    [[nodiscard]] double place(double value) const {
        return (std::log10(value) - low) / (high - low);
    }
};

std::string line(double x1, double y1, double x2, double y2) {
    return format("<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"#ddd\"/>\n", x1,
                  y1, x2, y2);
}

const char* kernels_color(const std::string& kernels) {
    return kernels == "plain" ? "#4e79a7" : kernels == "cpu" ? "#59a14f" : "#b07aa1";
}

/// One plot, whose upper edge is at `top`.
std::string plot(const std::vector<Point>& points, double top, const std::string& title) {
    const Range x(points, [](const Point& point) { return point.ms; });
    const Range y(points, [](const Point& point) { return std::max(point.error, 1e-9); });
    const auto at_x = [&](double ms) { return kLeft + kWidth * x.place(ms); };
    const auto at_y = [&](double error) {
        return top + kHeight * (1 - y.place(std::max(error, 1e-9)));
    };
    std::string svg = format(
        "<rect x=\"%g\" y=\"%g\" width=\"%g\" height=\"%g\" fill=\"none\" stroke=\"#999\"/>\n",
        kLeft, top, kWidth, kHeight);
    svg += svg_text(kLeft, top - 10, "start", title);
    svg += svg_text(kLeft + kWidth / 2, top + kHeight + 34, "middle", "shortest pass, ms");
    for (int power = -9; power <= 5; ++power)
        for (const double digit : {1.0, 2.0, 5.0}) {
            const double value = digit * std::pow(10, power);
            if (x.place(value) >= 0 && x.place(value) <= 1)
                svg += line(at_x(value), top, at_x(value), top + kHeight) +
                       svg_text(at_x(value), top + kHeight + 16, "middle", format("%g", value));
            if (y.place(value) >= 0 && y.place(value) <= 1)
                svg += line(kLeft, at_y(value), kLeft + kWidth, at_y(value)) +
                       svg_text(kLeft - 6, at_y(value) + 4, "end", format("%.0e", value));
        }
    // A point has the number of its label, above the points that are in one place.
    std::vector<std::string> labels;
    std::vector<std::pair<double, double>> used;
    for (const Point& point : points) {
        auto label = std::find(labels.begin(), labels.end(), point.label);
        if (label == labels.end()) {
            labels.push_back(point.label);
            label = labels.end() - 1;
        }
        const auto number = label - labels.begin() + 1;
        const double px = at_x(point.ms);
        double py = at_y(point.error) - 8;
        while (std::any_of(used.begin(), used.end(), [&](const auto& other) {
            return std::abs(other.first - px) < 9 && std::abs(other.second - py) < 12;
        }))
            py -= 12;
        used.emplace_back(px, py);
        svg += format("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"4\" fill=\"%s\"/>\n", px,
                      at_y(point.error), kernels_color(point.kernels));
        svg += svg_text(px, py, "middle", std::to_string(number));
    }
    for (std::size_t i = 0; i < labels.size(); ++i)
        svg += svg_text(kLeft + kWidth + 10, top + 14 + 16 * static_cast<double>(i), "start",
                        format("%zu  %s", i + 1, labels[i].c_str()));
    return svg;
}

}  // namespace

std::string tradeoff_svg(Run& run, const std::string& title) {
    constexpr double kSecond = kTop + kHeight + 80;
    const double height = kSecond + kHeight + 70;
    std::string svg = format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%g\" height=\"%g\" "
        "font-family=\"sans-serif\" font-size=\"11\">\n"
        "<rect width=\"100%%\" height=\"100%%\" fill=\"white\"/>\n",
        kLeft + kWidth + 140, height);
    svg += svg_text(kLeft, 22, "start", title);
    svg += plot(network_points(run), kTop, "a network by precision: relative L2 of its output");
    svg += plot(raster_points(run), kSecond,
                "the rasterizer with all skips, and without each: relative L2 of the image");
    const char* names[] = {"plain", "cpu", "gpu"};
    for (std::size_t i = 0; i < 3; ++i) {
        const double x = kLeft + 90 * static_cast<double>(i);
        svg += format("<circle cx=\"%g\" cy=\"%g\" r=\"4\" fill=\"%s\"/>\n", x, height - 14,
                      kernels_color(names[i]));
        svg += svg_text(x + 8, height - 10, "start", std::string(names[i]) + " kernels");
    }
    return svg + "</svg>\n";
}

}  // namespace vkrun::stress

// Run time of a network against its error, by precision.

#include "bench/model/model_errors.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <memory>

#include "core/os/path.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/svg.h"
#include "vkrun/cli/table.h"
#include "vkrun/cli/temporary_folder.h"
#include "vkrun/cli/text.h"

namespace vkrun::bench {
namespace {

constexpr std::array<std::pair<const char*, std::int32_t>, 3> kPrecisions = {
    {{"strict", SPLAT_PRECISION_STRICT},
     {"balanced", SPLAT_PRECISION_BALANCED},
     {"fast", SPLAT_PRECISION_FAST}}};

/// The compared arrays in the order of the peer's files: the raw output, then the arrays of the
/// Gaussians.
constexpr std::array<const char*, 6> kOutputs = {"raw",    "means",     "opacities",
                                                 "scales", "rotations", "sh"};
using Outputs = std::array<std::vector<double>, kOutputs.size()>;

/// Numbers of float64, in the order of kOutputs and as many as `like` has.
Outputs read_outputs(const std::string& path, const Outputs& like) {
    std::ifstream file(splat::os::path_of(path), std::ios::binary);
    Outputs outputs;
    for (std::size_t i = 0; i < outputs.size(); ++i) {
        outputs[i].resize(like[i].size());
        const auto bytes = static_cast<std::streamsize>(outputs[i].size() * sizeof(double));
        if (!file.read(reinterpret_cast<char*>(outputs[i].data()), bytes))
            throw Failure(kFailed, "the peer wrote fewer numbers than this network has, up to '" +
                                       std::string(kOutputs[i]) + "'");
    }
    if (file.peek() != std::ifstream::traits_type::eof())
        throw Failure(kFailed, "the peer wrote more numbers than this network has");
    return outputs;
}

void set_errors(ErrorRow& row, const Outputs& outputs, const Outputs& reference) {
    double difference = 0;
    double norm = 0;
    for (std::size_t i = 0; i < outputs.size(); ++i)
        for (std::size_t k = 0; k < outputs[i].size(); ++k) {
            const double error = outputs[i][k] - reference[i][k];
            if (i > 0) {
                row.largest = std::max(row.largest, std::abs(error));
                continue;
            }
            difference += error * error;
            norm += reference[i][k] * reference[i][k];
        }
    row.relative = std::sqrt(difference / norm);
}

void write_images(const std::string& path, const std::vector<float>& images) {
    std::ofstream file(splat::os::path_of(path), std::ios::binary);
    file.write(reinterpret_cast<const char*>(images.data()),
               static_cast<std::streamsize>(images.size() * sizeof(float)));
    if (!file.flush())
        throw Failure(kFailed, "cannot write '" + path + "': " + std::strerror(errno));
}

/// The range of a logarithmic axis: that of the values, and a factor of 2 more at both ends.
struct Axis {
    double low;
    double high;

    explicit Axis(const std::vector<double>& values)
        : low(std::log10(*std::min_element(values.begin(), values.end()) / 2)),
          high(std::log10(*std::max_element(values.begin(), values.end()) * 2)) {}
    [[nodiscard]] double place(double value) const {
        return (std::log10(value) - low) / (high - low);
    }
};

}  // namespace

ErrorMeasurement measure_errors(splat_device device, const ModelBenchOptions& options) {
    const TemporaryFolder folder;
    ErrorMeasurement measurement;
    std::vector<ErrorRow>& rows = measurement.rows;
    std::vector<std::unique_ptr<ModelRun>> runs;
    for (const auto& [name, precision] : kPrecisions) {
        ModelBenchOptions made = options;
        made.precision = precision;
        runs.push_back(std::make_unique<ModelRun>(device, made));
        rows.push_back({.who = name, .times = {}});
    }
    rows.push_back({.who = "PyTorch", .times = {}});
    runs.front()->save_weights(folder.file("weights.safetensors"));
    write_images(folder.file("images.f32"), runs.front()->images());

    measurement.model = runs.front()->report();
    measurement.gflop = runs.front()->gflop();
    const Json& config = measurement.model.at("config");
    std::vector<std::string> command = peer_command(options.peer, config, options.objects);
    command.insert(command.end(), {"--exchange", folder.path()});
    for (const char* key : {"fov", "znear", "zfar"})
        command.insert(command.end(), {std::string("--") + key, config.at("data").at(key).dump()});
    for (const char* axis : {"x", "y"}) {
        const bool inverted = config.at("model").at(std::string("inverted_") + axis).get<bool>();
        command.insert(command.end(), {std::string("--inverted-") + axis, inverted ? "1" : "0"});
    }
    const auto peer = start_torch(options.peer, command);
    measurement.peer = peer->about();
    for (int call = 0; call < options.rounds + 2; ++call)
        for (std::size_t i = 0; i < rows.size(); ++i)
            rows[i].times.add(i < runs.size() ? runs[i]->forward() : peer->run("forward"), call);

    Outputs ours;
    for (std::size_t k = 0; k < kOutputs.size(); ++k) ours[k] = runs.front()->output(kOutputs[k]);
    peer->run("outputs");
    const Outputs reference = read_outputs(folder.file("float64.f64"), ours);
    set_errors(rows.back(), read_outputs(folder.file("float32.f64"), ours), reference);
    for (std::size_t i = 0; i < runs.size(); ++i) {
        for (std::size_t k = 0; k < kOutputs.size(); ++k) ours[k] = runs[i]->output(kOutputs[k]);
        set_errors(rows[i], ours, reference);
    }
    return measurement;
}

std::string errors_table(const std::vector<ErrorRow>& rows) {
    Table table({"  forward", ">min ms", ">median ms", ">raw rel. L2", ">largest error"});
    for (const ErrorRow& row : rows)
        table.add({"  " + row.who, format("%.2f", row.times.min_ms()),
                   format("%.2f", row.times.median_ms()), format("%.1e", row.relative),
                   format("%.1e", row.largest)});
    return table.text();
}

Json errors_json(const std::vector<ErrorRow>& rows) {
    Json json = Json::array();
    for (const ErrorRow& row : rows)
        json.push_back({{"who", row.who},
                        {"first_ms", row.times.first_ms},
                        {"second_ms", row.times.second_ms},
                        {"min_ms", row.times.min_ms()},
                        {"median_ms", row.times.median_ms()},
                        {"times_ms", row.times.times_ms},
                        {"raw_relative_l2", row.relative},
                        {"largest_error", row.largest}});
    return json;
}

std::string errors_svg(const std::vector<ErrorRow>& rows, const std::string& title) {
    constexpr double kLeft = 80, kTop = 50, kWidth = 520, kHeight = 300;
    std::vector<double> times, errors;
    for (const ErrorRow& row : rows) {
        times.push_back(row.times.min_ms());
        errors.push_back(std::max(row.relative, 1e-16));  // so that an exact result has a logarithm
    }
    const Axis x(times), y(errors);
    const auto at_x = [&](double value) { return kLeft + kWidth * x.place(value); };
    const auto at_y = [&](double value) { return kTop + kHeight * (1 - y.place(value)); };
    std::string svg = format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%g\" height=\"%g\" "
        "font-family=\"sans-serif\" font-size=\"12\">\n"
        "<rect width=\"100%%\" height=\"100%%\" fill=\"white\"/>\n"
        "<rect x=\"%g\" y=\"%g\" width=\"%g\" height=\"%g\" fill=\"none\" stroke=\"#999\"/>\n",
        kLeft + kWidth + 30, kTop + kHeight + 60, kLeft, kTop, kWidth, kHeight);
    svg += svg_text(kLeft, 24, "start", title);
    svg += svg_text(kLeft + kWidth / 2, kTop + kHeight + 45, "middle", "shortest forward pass, ms");
    svg += svg_text(10, kTop - 10, "start", "error: relative L2 of the raw output");
    for (int power = -17; power <= 9; ++power)
        for (const double digit : {1.0, 2.0, 5.0}) {
            const double value = digit * std::pow(10, power);
            if (x.place(value) >= 0 && x.place(value) <= 1) {
                svg +=
                    format("<line x1=\"%.1f\" x2=\"%.1f\" y1=\"%g\" y2=\"%g\" stroke=\"#ddd\"/>\n",
                           at_x(value), at_x(value), kTop, kTop + kHeight);
                svg += svg_text(at_x(value), kTop + kHeight + 18, "middle", format("%g", value));
            }
            if (y.place(value) >= 0 && y.place(value) <= 1) {
                svg +=
                    format("<line x1=\"%g\" x2=\"%g\" y1=\"%.1f\" y2=\"%.1f\" stroke=\"#ddd\"/>\n",
                           kLeft, kLeft + kWidth, at_y(value), at_y(value));
                svg += svg_text(kLeft - 6, at_y(value) + 4, "end", format("%.0e", value));
            }
        }
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const bool peer = i + 1 == rows.size();
        svg += format("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"5\" fill=\"%s\"/>\n", at_x(times[i]),
                      at_y(errors[i]), peer ? "#e15759" : "#4e79a7");
        // Labels alternate above and below, so that those of close points do not overlap.
        svg += svg_text(at_x(times[i]) + 8, at_y(errors[i]) + (i % 2 == 0 ? -6 : 16), "start",
                        rows[i].who);
    }
    return svg + "</svg>\n";
}

}  // namespace vkrun::bench

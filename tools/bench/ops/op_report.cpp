// The figures of operators as JSON and as a table, and sentences about wrong results.

#include <cstdlib>

#include "bench/ops/op_bench.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/table.h"
#include "vkrun/cli/text.h"

namespace vkrun::bench {
namespace {

Json figures_json(const KernelFigures& figures) {
    const TensorError most = worst(figures.errors);
    Json json;
    json["kernels"] = figures.kernels;
    json["min_ms"] = figures.min_ms();
    json["median_ms"] = figures.median_ms();
    json["layout_ms"] = figures.median_layout_ms();
    json["gb_per_s"] = figures.gigabytes_per_second();
    json["gflop_per_s"] = figures.gigaflops();
    json["relative_l2"] = most.relative_l2;
    json["max_error"] = most.max_abs;
    json["max_roundings"] = most.max_roundings;
    json["good"] = good(figures.errors);
    json["errors"] = Json::array();
    for (const TensorError& error : figures.errors) {
        Json one;
        one["tensor"] = error.tensor;
        one["relative_l2"] = error.relative_l2;
        one["max_error"] = error.max_abs;
        one["max_roundings"] = error.max_roundings;
        json["errors"].push_back(std::move(one));
    }
    json["times_ms"] = figures.times_ms;
    json["dispatches"] = Json::array();
    for (const DispatchTime& dispatch : figures.dispatches) {
        Json one;
        one["op"] = dispatch.label;
        one["kernel"] = dispatch.shader;
        one["ms"] = dispatch.ms;
        json["dispatches"].push_back(std::move(one));
    }
    return json;
}

/// Memory bounds an operator that does a few operations per element; arithmetic bounds a product.
bool by_bytes(const Measurement& measurement) {
    return measurement.op != "linear" && measurement.op != "conv2d";
}

}  // namespace

Json measurement_json(const Measurement& measurement) {
    Json json;
    json["op"] = measurement.op;
    json["case"] = measurement.title;
    json["attributes"] = measurement.attributes;
    json["shapes"] = measurement.shapes;
    json["direction"] = measurement.direction;
    json["bytes"] = measurement.fast.bytes;
    json["flops"] = measurement.fast.flops;
    json["fast"] = figures_json(measurement.fast);
    if (!measurement.has_plain()) return json;
    json["plain"] = figures_json(measurement.plain);
    json["ratio_min"] = measurement.plain.min_ms() / measurement.fast.min_ms();
    json["ratio_median"] = measurement.plain.median_ms() / measurement.fast.median_ms();
    return json;
}

std::vector<std::string> notes_on(const splat_device_info& plain, const splat_device_info& fast) {
    std::vector<std::string> notes;
    const char* forced = std::getenv("SPLAT_KERNELS");
    const bool is_forced = forced != nullptr && *forced != '\0' && std::string(forced) != "auto";
    if (is_forced)
        notes.push_back(std::string("SPLAT_KERNELS=") + forced +
                        ": both sides run the same kernels, so plain/fast is noise");
    else if (plain.kernels == fast.kernels)
        notes.emplace_back(
            "this device has plain kernels only: both sides run them, so plain/fast is noise");
    const char* validation = std::getenv("SPLAT_VALIDATION");
    if (validation != nullptr && *validation != '\0' && std::string(validation) != "0")
        notes.emplace_back("SPLAT_VALIDATION is set: instrumented shaders were timed");
    if ((fast.features & SPLAT_FEATURE_TIMESTAMPS) == 0)
        notes.emplace_back("this device has no timestamps");
    return notes;
}

std::vector<std::string> wrong_results(const std::vector<Measurement>& measurements) {
    std::vector<std::string> sentences;
    for (const Measurement& m : measurements)
        for (const KernelFigures* figures : {&m.plain, &m.fast})  // without errors if not run
            for (const TensorError& error : figures->errors)
                if (!good({error}))
                    sentences.push_back(
                        format("%s %s, %s kernels: %s is wrong by up to %.3g roundings, "
                               "expected at most %g",
                               m.op.c_str(), m.title.c_str(), figures->kernels.c_str(),
                               error.tensor.c_str(), error.max_roundings, kErrorLimit));
    return sentences;
}

std::string measurement_table(const std::vector<Measurement>& measurements) {
    std::string text;
    std::string op;
    Table table({});
    const auto finish = [&] {
        if (!op.empty()) text += op + "\n" + table.text() + "\n";
    };
    std::string title;
    for (const Measurement& m : measurements) {
        if (m.op != op) {
            finish();
            op = m.op;
            title.clear();
            table = Table({"  case", "direction", "kernels", ">runs", ">min ms", ">median ms",
                           by_bytes(m) ? ">GB/s" : ">GFLOP/s", ">plain/fast", ">rel. L2",
                           ">max error", ">layout ms"});
        }
        for (const KernelFigures* figures : {&m.plain, &m.fast}) {
            if (figures->times_ms.empty()) continue;
            const bool first = figures == &m.plain || !m.has_plain();
            const TensorError most = worst(figures->errors);
            table.add({first && m.title != title ? "  " + m.title : "", first ? m.direction : "",
                       figures->kernels, format("%zu", figures->times_ms.size()),
                       format("%.3f", figures->min_ms()), format("%.3f", figures->median_ms()),
                       format("%.2f",
                              by_bytes(m) ? figures->gigabytes_per_second() : figures->gigaflops()),
                       first ? "" : format("%.2f", m.plain.min_ms() / m.fast.min_ms()),
                       format("%.1e", most.relative_l2), format("%.1e", most.max_abs),
                       format("%.3f", figures->median_layout_ms())});
        }
        title = m.title;
    }
    finish();
    return text;
}

}  // namespace vkrun::bench

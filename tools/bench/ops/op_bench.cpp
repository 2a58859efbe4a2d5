// Times an operator: two devices run it alternately; device time by dispatch.

#include <algorithm>

#include "bench/ops/op_bench.h"

#include "bench/ops/conv2d_samples.h"

#include "bench/median.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/stopwatch.h"

namespace vkrun::bench {
namespace {

/// Conversions between the caller's layout and the operators' own: at the graph's edges, or when a
/// weight changes.
bool is_layout(const std::string& label) {
    return label.rfind("quads_", 0) == 0 || label.find("_pack") != std::string::npos;
}

void add_sample(splat_device device, KernelFigures& figures) {
    const auto profile = library_json(splat_device_profile_json, device);
    double time = 0;
    double layout = 0;
    figures.bytes = 0;
    figures.flops = 0;
    figures.dispatches.clear();
    for (const Json& row : profile.at("ops")) {
        const double total = row.at("total_ms").get<double>();
        const auto label = row.at("op").get<std::string>();
        figures.dispatches.push_back({label, row.at("kernel").get<std::string>(), total});
        if (is_layout(label)) {
            layout += total;
            continue;
        }
        const double count = row.at("count").get<double>();
        time += total;
        figures.bytes += count * row.at("bytes").get<double>();
        figures.flops += count * row.at("flops").get<double>();
    }
    if (time <= 0)
        throw Failure(kFailed, "the profile of the device holds no time: it has no timestamps");
    figures.times_ms.push_back(time);
    figures.layout_ms.push_back(layout);
}

struct Contender {
    splat_device device;
    CaseOnDevice run;
    KernelFigures* figures;
};

void sample(Contender& side, bool backward) {
    check(splat_device_profile_reset(side.device));
    if (backward)
        side.run.backward();
    else
        side.run.forward();
    add_sample(side.device, *side.figures);
}

Json shapes_of(const OpCase& op_case) {
    Json shapes;
    for (const CaseTensor& input : op_case.inputs) shapes[input.name] = input.dims;
    for (const CaseTensor& output : op_case.outputs) shapes[output.name] = output.dims;
    return shapes;
}

}  // namespace

double KernelFigures::min_ms() const {
    return *std::min_element(times_ms.begin(), times_ms.end());
}

double KernelFigures::median_ms() const {
    return median_of(times_ms);
}

double KernelFigures::median_layout_ms() const {
    return median_of(layout_ms);
}

std::vector<Measurement> measure(const BenchDevices& devices, const OpCase& op_case,
                                 const Effort& effort) {
    const CaseReference reference = sampled_reference_of(op_case);
    std::vector<Measurement> measurements;
    std::vector<Contender> sides;
    if (op_case.plain)
        sides.push_back({devices.plain.get(), CaseOnDevice(devices.plain.get(), op_case), nullptr});
    sides.push_back({devices.fast.get(), CaseOnDevice(devices.fast.get(), op_case), nullptr});
    for (const bool backward : {false, true}) {
        Measurement one{op_case.op,
                        op_case.title,
                        op_case.attributes,
                        shapes_of(op_case),
                        backward ? "backward" : "forward",
                        {},
                        {}};
        sides.front().figures = &one.plain;
        sides.back().figures = &one.fast;
        for (Contender& side : sides) {  // a first run outside the figures: pipelines, caches
            side.figures->kernels = kernels_name(info_of(side.device).kernels);
            sample(side, backward);
            side.figures->times_ms.clear();
            side.figures->layout_ms.clear();
            side.figures->errors = backward ? backward_errors(op_case, side.run, reference)
                                            : forward_errors(op_case, side.run, reference);
        }
        const Stopwatch watch;
        for (int i = 0; i < effort.repeat; ++i) {
            if (i >= kFewestRuns && watch.seconds() > effort.seconds) break;
            for (Contender& side : sides) sample(side, backward);
        }
        measurements.push_back(std::move(one));
    }
    return measurements;
}

}  // namespace vkrun::bench

#pragma once

#include <string>
#include <vector>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/doctor/op_case.h"

namespace vkrun::bench {

/// The latest device time of one of a run's dispatches.
struct DispatchTime {
    std::string label;
    std::string shader;
    double ms = 0;
};

/// Device times of one set of kernels on one case in one direction.
struct KernelFigures {
    std::string kernels;           ///< "plain", "cpu" or "gpu"
    std::vector<double> times_ms;  ///< the operator's own dispatches, one per run
    std::vector<double>
        layout_ms;     ///< packing and unpacking, once per network and not per operator
    double bytes = 0;  ///< bytes that one run must move, as the operator counts them
    double flops = 0;
    std::vector<DispatchTime> dispatches;  ///< the last run, layout conversions included
    std::vector<TensorError> errors;

    [[nodiscard]] double min_ms() const;
    [[nodiscard]] double median_ms() const;
    [[nodiscard]] double median_layout_ms() const;
    /// 1e9 per second, at the shortest time.
    [[nodiscard]] double gigabytes_per_second() const { return bytes / min_ms() * 1e-6; }
    [[nodiscard]] double gigaflops() const { return flops / min_ms() * 1e-6; }
};

struct Measurement {
    std::string op;
    std::string title;
    Json attributes;
    Json shapes;
    std::string direction;  ///< "forward" or "backward"
    KernelFigures plain;    ///< without times where the case asks for none
    KernelFigures fast;

    [[nodiscard]] bool has_plain() const { return !plain.times_ms.empty(); }
};

/// Two devices on the same hardware: one with plain kernels, the other with the best.
struct BenchDevices {
    Device plain;
    Device fast;
};

/// How often to repeat: until both sides had `repeat` runs, or kFewestRuns once `seconds` are over.
struct Effort {
    int repeat;
    double seconds;
};
constexpr int kFewestRuns = 3;

/// Forward and backward of a case; the two sets of kernels run alternately.
std::vector<Measurement> measure(const BenchDevices& devices, const OpCase& op_case,
                                 const Effort& effort);

/// The cases of an operator: those of the network, or one small one. Throws a Failure if there is none.
std::vector<OpCase> bench_cases(const std::string& op, bool quick);

/// All operators of the library.
std::vector<std::string> bench_ops();

/// What a reader of the figures has to know about this run, from the infos of both devices.
std::vector<std::string> notes_on(const splat_device_info& plain, const splat_device_info& fast);

/// Wrong results, one sentence each.
std::vector<std::string> wrong_results(const std::vector<Measurement>& measurements);

Json measurement_json(const Measurement& measurement);
std::string measurement_table(const std::vector<Measurement>& measurements);

}  // namespace vkrun::bench

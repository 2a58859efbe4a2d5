#pragma once

#include <string>
#include <vector>

#include "bench/model/model_bench.h"
#include "vkrun/cli/json.h"

namespace vkrun::bench {

/// Time and error of a forward pass: a precision of libsplat, or PyTorch in float32.
struct ErrorRow {
    std::string who;
    PassTimes times;
    double relative = 0;  ///< L2 of the network's raw output, relative to that of the reference
    double largest = 0;   ///< absolute error of any number of a Gaussian
};

struct ErrorMeasurement {
    Json model;  ///< report of the model
    Json peer;   ///< PyTorch's description of itself
    double gflop = 0;
    std::vector<ErrorRow> rows;
};

/// Every precision and PyTorch alternately, on the same weights and images, against PyTorch in
/// float64.
ErrorMeasurement measure_errors(splat_device device, const ModelBenchOptions& options);

std::string errors_table(const std::vector<ErrorRow>& rows);
Json errors_json(const std::vector<ErrorRow>& rows);

/// An SVG file: error over time, both logarithmic.
std::string errors_svg(const std::vector<ErrorRow>& rows, const std::string& title);

}  // namespace vkrun::bench

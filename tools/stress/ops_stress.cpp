// Every operator of the library's list, forward and backward, over families of inputs.

#include <algorithm>
#include <cmath>

#include "bench/ops/op_bench.h"
#include "stress/op_families.h"
#include "stress/op_peer.h"
#include "stress/stress.h"
#include "vkrun/cli/text.h"

namespace vkrun::stress {
namespace {

using bench::CaseOnDevice;
using bench::OpCase;
using bench::Samples;

/// A term below float32's smallest normal number, 2^-126, may become zero. A factor of it is at most 2^7 where
/// an exponential of float32 has not yet vanished: x exp(-x).
constexpr double kUnderflow = 0x1p-119;

/// Of SSIM, whose value is at most 1; its variances, as differences of squares, would allow more.
constexpr double kSsim = 2e-6;  // the project's goal, tests/support/tolerances.h

constexpr const char* kReason =
    "4 x 2^-24 (1 + sqrt K) S: roundings of a sum of K terms whose magnitudes, conditions "
    "included, add up to S (8 x for Winograd's F(4x4)); K x 2^-119 for underflow; of SSIM at most "
    "2e-6";

Expected expected_op(const OpCase& op_case, const Samples& samples) {
    const auto& sums = samples.sums;
    const auto terms = static_cast<double>(sums.terms);
    const bool winograd4 = op_case.attributes.value("winograd", 0) == 4;
    const double factor = bench::kErrorLimit * (winograd4 ? 2 : 1) * kRounding;
    Expected expected{sums.value, {}, sums.magnitude};
    for (const double magnitude : sums.magnitude)
        expected.allowed.push_back(factor * (1 + std::sqrt(terms)) * magnitude +
                                   (terms + 1) * kUnderflow);
    if (op_case.op == "ssim" && expected.value.size() == 1)
        expected.allowed[0] = std::min(expected.allowed[0], kSsim);
    return expected;
}

std::vector<float> chosen(const std::vector<float>& values, const Samples& samples) {
    if (samples.elements.empty()) return values;
    std::vector<float> some;
    for (const std::size_t element : samples.elements) some.push_back(values[element]);
    return some;
}

struct Result {
    std::string name;
    Samples reference;
    bool is_gradient;
    std::size_t index;
};

std::vector<Result> results_of(const OpCase& op_case) {
    bench::CaseReference reference = reference_about_pivots(op_case);
    std::vector<Result> results;
    for (std::size_t i = 0; i < op_case.outputs.size(); ++i)
        results.push_back({op_case.outputs[i].name, reference.outputs[i], false, i});
    for (std::size_t i = 0; i < op_case.inputs.size(); ++i)
        if (!op_case.inputs[i].constant)
            results.push_back(
                {"grad_" + op_case.inputs[i].name, reference.grad_inputs[i], true, i});
    return results;
}

std::vector<float> read(const CaseOnDevice& run, const Result& result) {
    return result.is_gradient ? run.grad_input(result.index) : run.output(result.index);
}

void run_op_with(Run& run, const OpStress& stress, const KernelDevice& with,
                 const std::vector<Result>& results, const PeerResults& others) {
    CaseOnDevice on_device(with.device.get(), stress.op_case);
    std::vector<std::vector<float>> first;
    for (const bool again : {false, true}) {
        on_device.forward();
        on_device.backward();
        for (std::size_t i = 0; i < results.size(); ++i) {
            std::vector<float> got = chosen(read(on_device, results[i]), results[i].reference);
            if (!again) {
                first.push_back(std::move(got));
                continue;
            }
            const Expected expected = expected_op(stress.op_case, results[i].reference);
            Row row{"ops", stress.name, stress.input, results[i].name, with.kernels, kReason};
            if (const auto other = others.find(results[i].name); other != others.end())
                row.peer = peer_error(chosen(other->second, results[i].reference), expected);
            run.add(std::move(row), std::move(first[i]), got, expected);
        }
    }
}

void run_op(Run& run, const OpStress& stress, OpPeer& peer) {
    const std::vector<Result> results = results_of(stress.op_case);
    const PeerResults others = peer.results_of(stress.op_case);
    for (const KernelDevice& with : run.devices())
        run.unless_refused("ops/" + stress.name + ", " + with.kernels,
                           [&] { run_op_with(run, stress, with, results, others); });
}

}  // namespace

void stress_ops(Run& run) {
    OpPeer peer(run.options().python);
    for (const std::string& op : bench::bench_ops())
        for (const OpStress& stress : op_families(op, run.quick()))
            if (run.wants(stress.name)) run_op(run, stress, peer);
}

}  // namespace vkrun::stress

// Every operator of the library's list, forward and backward, over families of inputs.

#include <optional>

#include "bench/ops/op_bench.h"
#include "stress/op_bound.h"
#include "stress/op_families.h"
#include "stress/op_peer.h"
#include "stress/stress.h"
#include "vkrun/cli/text.h"

namespace vkrun::stress {
namespace {

std::vector<float> chosen(const std::vector<float>& values, const Samples& samples) {
    if (samples.elements.empty()) return values;
    std::vector<float> some;
    for (const std::size_t element : samples.elements) some.push_back(values[element]);
    return some;
}

struct Result {
    std::string name;
    Samples reference;
    Expected expected;
    bool is_gradient;
    std::size_t index;
};

std::vector<Result> results_of(const OpCase& op_case) {
    const CaseReference reference = reference_about_pivots(op_case);
    const OpCase zeroed = with_denormals_zeroed(op_case);
    std::optional<CaseReference> flushed;
    if (has_other_values(zeroed, op_case)) flushed = reference_about_pivots(zeroed);
    std::vector<Result> results;
    const auto add = [&](const std::string& name, bool is_gradient, std::size_t index) {
        const auto of = [&](const CaseReference& from) -> const Samples& {
            return is_gradient ? from.grad_inputs[index] : from.outputs[index];
        };
        const Samples& samples = of(reference);
        results.push_back(
            {name, samples,
             expected_op(op_case, samples.sums, flushed ? &of(*flushed).sums : nullptr),
             is_gradient, index});
    };
    for (std::size_t i = 0; i < op_case.outputs.size(); ++i) add(op_case.outputs[i].name, false, i);
    for (std::size_t i = 0; i < op_case.inputs.size(); ++i)
        if (!op_case.inputs[i].constant) add("grad_" + op_case.inputs[i].name, true, i);
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
            const Expected& expected = results[i].expected;
            Row row{"ops", stress.name, stress.input, results[i].name, with.kernels, kOpReason};
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

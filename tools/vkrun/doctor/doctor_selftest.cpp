// vkrun doctor: whether the device computes correct results.

#include <cmath>
#include <cstring>
#include <limits>

#include "ref/group_norm_ref.h"
#include "ref/linear_ref.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/text.h"
#include "vkrun/doctor/doctor.h"
#include "vkrun/doctor/op_case.h"

namespace vkrun {
namespace {

constexpr const char* kWrong =
    "update the driver; try SPLAT_KERNELS=plain and another device (--device), and report this "
    "with "
    "the output of 'vkrun doctor --json'";

bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

Finding errors_finding(const std::string& check, const std::string& what,
                       const std::vector<TensorError>& errors) {
    const TensorError most = worst(errors);
    const std::string words =
        format("%s: relative error %.1e, %.2f of %g roundings allowed", what.c_str(),
               most.relative_l2, most.max_roundings, kErrorLimit);
    if (good(errors)) return {check, State::kOk, words, ""};
    std::string tensors;
    for (const TensorError& error : errors)
        if (!good({error})) tensors += (tensors.empty() ? "" : ", ") + error.tensor;
    return {check, State::kError, words + "; wrong: " + tensors, kWrong};
}

/// Odd sizes, and sizes that suit the fast kernels.
std::vector<OpCase> self_test_cases() {
    return {example_case("group_norm", splat::ref::group_norm_example({2, 32, 9, 7}, 4, true)),
            example_case("linear", splat::ref::linear_example(37, 28, 19))};
}

Findings check_operator(splat_device device, const char* kernels, const OpCase& op_case) {
    const std::string name = op_case.op + " (" + kernels + ")";
    const CaseReference reference = reference_of(op_case);
    CaseOnDevice run(device, op_case);
    run.forward();
    const std::vector<float> first = run.output(0);
    run.backward();
    Findings findings{
        errors_finding(name, "forward " + op_case.title, forward_errors(op_case, run, reference)),
        errors_finding(name, "backward " + op_case.title,
                       backward_errors(op_case, run, reference))};
    run.forward();
    if (!same_bits(first, run.output(0)))
        findings.push_back({name, State::kError, "two runs gave different bits", kWrong});
    return findings;
}

Finding check_round_trip(splat_device device) {
    std::vector<float> data(3 * 5 * 7);
    for (std::size_t i = 0; i < data.size(); ++i)
        data[i] = 1.0F / static_cast<float>(i + 1) - 0.25F;
    const Tensor tensor = make_tensor(device, "doctor", {3, 5, 7}, data);
    if (same_bits(read_tensor(tensor.get()), data))
        return {"tensor", State::kOk, "a tensor written and read back is the same", ""};
    return {"tensor", State::kError, "a tensor written and read back differs", kWrong};
}

Finding check_statistics(splat_device device) {
    std::vector<float> data(1000, 0.5F);
    data[3] = std::numeric_limits<float>::quiet_NaN();
    data[500] = data[999] = std::numeric_limits<float>::infinity();
    data[7] = -2;
    data[8] = 3;
    const Tensor tensor = make_tensor(device, "doctor", {10, 100}, data);
    auto stats = sized<splat_tensor_stats>();
    check(splat_tensor_check(tensor.get(), &stats));
    const double mean = (995 * 0.5 - 2 + 3) / 997;  // mean of the finite ones
    const bool right = stats.nan_count == 1 && stats.inf_count == 2 && stats.min == -2.0 &&
                       stats.max == 3.0 && std::abs(stats.mean - mean) < 1e-5;
    const std::string words =
        format("statistics of a tensor: %llu NaN, %llu infinite, min %g, max %g, mean %.6f",
               static_cast<unsigned long long>(stats.nan_count),
               static_cast<unsigned long long>(stats.inf_count), stats.min, stats.max, stats.mean);
    if (right) return {"tensor", State::kOk, words, ""};
    return {"tensor", State::kError, words + format("; expected 1, 2, -2, 3, %.6f", mean), kWrong};
}

}  // namespace

Findings check_operators(const splat_device_desc& desc) {
    Findings findings;
    splat_kernels before = SPLAT_KERNELS_AUTO;
    for (const splat_kernels kernels : {SPLAT_KERNELS_AUTO, SPLAT_KERNELS_PLAIN}) {
        splat_device_desc one = desc;
        one.kernels = kernels;
        const Device device = open_device(one);
        const splat_kernels runs = info_of(device.get()).kernels;
        if (runs == before) continue;
        before = runs;
        const std::string known = info_of(device.get()).kernels_note;
        for (const OpCase& op_case : self_test_cases()) try {
                for (Finding& finding : check_operator(device.get(), kernels_name(runs), op_case))
                    findings.push_back(std::move(finding));
            } catch (const Failure& failure) {
                findings.push_back({op_case.op, State::kError, failure.what(), kWrong});
            }
        if (const splat_device_info now = info_of(device.get()); known != now.kernels_note)
            findings.push_back(kernels_finding(now));
    }
    return findings;
}

Findings check_tensors(splat_device device) {
    return {check_round_trip(device), check_statistics(device)};
}

void run_one_operator(splat_device device) {
    CaseOnDevice run(device, self_test_cases().front());
    run.forward();
    run.backward();
    static_cast<void>(run.output(0));
}

}  // namespace vkrun

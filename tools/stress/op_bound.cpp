#include "stress/op_bound.h"

#include <algorithm>
#include <cmath>

namespace vkrun::stress {
namespace {

/// A term below float32's smallest normal number, 2^-126, may become zero. A factor of it is at most 2^7 where
/// an exponential of float32 has not yet vanished: x exp(-x).
constexpr double kUnderflow = 0x1p-119;

/// Error of SSIM, whose value is at most 1; its variances, as differences of squares, would allow more.
constexpr double kSsim = 2e-6;  // the project's goal, tests/support/tolerances.h

std::vector<double> allowed_of(const OpCase& op_case, const splat::ref::Summed<double>& sums) {
    const auto terms = static_cast<double>(sums.terms);
    const bool winograd4 = op_case.attributes.value("winograd", 0) == 4;
    const double factor = kErrorLimit * (winograd4 ? 2 : 1) * kRounding;
    std::vector<double> allowed;
    for (const double magnitude : sums.magnitude)
        allowed.push_back(factor * (1 + std::sqrt(terms)) * magnitude + (terms + 1) * kUnderflow);
    if (op_case.op == "ssim" && sums.value.size() == 1) allowed[0] = std::min(allowed[0], kSsim);
    return allowed;
}

}  // namespace

const char* const kOpReason =
    "4 x 2^-24 (1 + sqrt K) S: roundings of a sum of K terms whose magnitudes, conditions "
    "included, add up to S (8 x for Winograd's F(4x4)); K x 2^-119 for underflow; of SSIM at most "
    "2e-6. From the exact result, or, as devices may flush denormal inputs, from that of these as "
    "zeros";

Expected expected_op(const OpCase& op_case, const splat::ref::Summed<double>& sums,
                     const splat::ref::Summed<double>* flushed) {
    Expected expected{sums.value, allowed_of(op_case, sums), sums.magnitude};
    if (flushed == nullptr) return expected;
    expected.other = flushed->value;
    expected.other_allowed = allowed_of(op_case, *flushed);
    return expected;
}

OpCase with_denormals_zeroed(const OpCase& op_case) {
    OpCase zeroed = op_case;
    for (std::vector<CaseTensor>* tensors : {&zeroed.inputs, &zeroed.outputs})
        for (CaseTensor& tensor : *tensors)
            for (float& value : tensor.values)
                if (std::fpclassify(value) == FP_SUBNORMAL) value = std::copysign(0.0F, value);
    return zeroed;
}

bool has_other_values(const OpCase& a, const OpCase& b) {
    const auto same = [](const CaseTensor& one, const CaseTensor& other) {
        return one.values == other.values;
    };
    return !std::equal(a.inputs.begin(), a.inputs.end(), b.inputs.begin(), same) ||
           !std::equal(a.outputs.begin(), a.outputs.end(), b.outputs.begin(), same);
}

}  // namespace vkrun::stress

#include "stress/op_families.h"

#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <utility>

#include "bench/ops/conv2d_samples.h"
#include "bench/ops/op_bench.h"
#include "stress/own_families.h"
#include "vkrun/cli/text.h"

namespace vkrun::stress {
namespace {

std::string power(int exponent) {
    return format("1e%d", exponent);
}

void scale(CaseTensor& tensor, double factor) {
    for (float& value : tensor.values)
        value = static_cast<float>(static_cast<double>(value) * factor);
}

/// Beyond these an operator has no meaning: images, whose edges have no sign where they are less than a rounding of the
/// mean, and angles of which nothing is left after rounding.
struct Domain {
    const char* op;
    double largest;  ///< magnitude of its first input
    double mean;     ///< largest mean over deviation
};
constexpr Domain kDomains[] = {{"ssim", 1e3, 1e3},
                               {"edge_loss", 1e38, 1e4},
                               {"fourier_embedding", 1e3, 1e2},
                               {"positional_embedding", 1e3, 1e2}};

bool in_domain(const std::string& op, double magnitude, double mean) {
    for (const Domain& domain : kDomains)
        if (op == domain.op) return magnitude <= domain.largest && mean <= domain.mean;
    return true;
}

using Add = std::function<void(const std::string&, const std::string&,
                               const std::function<void(OpCase&)>&)>;

void add_magnitudes(const std::string& op, bool quick, const Add& add) {
    const std::vector<int> exponents =
        quick ? std::vector<int>{-40, -30, 10, 20, 30}
              : std::vector<int>{-44, -40, -38, -30, -20, -10, -3, 3, 10, 18, 20, 25, 30, 34};
    for (const int exponent : exponents)
        if (in_domain(op, std::pow(10, exponent), 0))
            add("magnitude_" + power(exponent),
                "numbers of " + power(exponent) + (exponent < -37 ? ", denormal" : ""),
                [&](OpCase& op_case) { scale(op_case.inputs[0], std::pow(10, exponent)); });
    for (const int exponent :
         quick ? std::vector<int>{-30, 30} : std::vector<int>{-40, -30, 20, 30})
        add("gradient_" + power(exponent), "gradients of outputs of " + power(exponent),
            [&](OpCase& op_case) {
                for (CaseTensor& output : op_case.outputs) scale(output, std::pow(10, exponent));
            });
}

void add_means(const std::string& op, bool quick, const Add& add) {
    for (const int exponent :
         quick ? std::vector<int>{3, 4} : std::vector<int>{0, 1, 2, 3, 4, 5, 6})
        if (in_domain(op, 0, std::pow(10, exponent)))
            add("mean_" + power(exponent), "mean " + power(exponent) + ", deviation 1",
                [&](OpCase& op_case) {
                    CaseTensor& x = op_case.inputs[0];
                    std::vector<std::size_t> dims(x.dims.begin(), x.dims.end());
                    x.values = filled("", dims, 77, std::pow(10, exponent), 1).values;
                });
}

/// Pairs of neighbours that add up to a millionth of one of them.
void cancel(CaseTensor& x) {
    for (std::size_t i = 0; i + 1 < x.values.size(); i += 2) {
        const double value = 1e4 * static_cast<double>(x.values[i]);
        const double rest = 1 + 1e-6 * static_cast<double>(x.values[i + 1]);
        x.values[i] = static_cast<float>(value);
        x.values[i + 1] = static_cast<float>(-value * rest);
    }
}

/// Takes the float32 number nearest to the mean of `count` numbers, each `step` behind the one before, off them, where
/// that is exact.
void take_about_pivot(std::vector<float>& x, std::size_t first, std::size_t count,
                      std::size_t step) {
    double sum = 0;
    for (std::size_t k = 0; k < count; ++k) sum += static_cast<double>(x[first + k * step]);
    const auto pivot = static_cast<double>(static_cast<float>(sum / static_cast<double>(count)));
    bool exact = true;
    for (std::size_t k = 0; k < count; ++k) {
        const double rest = static_cast<double>(x[first + k * step]) - pivot;
        exact = exact && static_cast<double>(static_cast<float>(rest)) == rest;
    }
    for (std::size_t k = 0; exact && k < count; ++k) {
        float& value = x[first + k * step];
        value = static_cast<float>(static_cast<double>(value) - pivot);
    }
}

}  // namespace

std::vector<OpStress> op_families(const std::string& op, bool quick) {
    const OpCase usual = bench::bench_cases(op, true).front();
    std::vector<OpStress> families;
    const Add add = [&](const std::string& name, const std::string& input,
                        const std::function<void(OpCase&)>& change) {
        OpCase changed = usual;
        change(changed);
        families.push_back({op + "/" + name, input, std::move(changed)});
    };
    add("usual", "normal numbers", [](OpCase&) {});
    add("zero", "zeros", [](OpCase& op_case) { scale(op_case.inputs[0], 0); });
    if (in_domain(op, 1e4, 0))
        add("cancellation", "pairs that cancel to 1e-6",
            [](OpCase& op_case) { cancel(op_case.inputs[0]); });
    add_means(op, quick, add);
    add_magnitudes(op, quick, add);
    std::vector<OpStress> own = own_families(op, quick);
    std::move(own.begin(), own.end(), std::back_inserter(families));
    return families;
}

namespace {

void widen(Samples& samples, const Samples& other) {
    for (std::size_t i = 0; i < samples.sums.magnitude.size(); ++i)
        samples.sums.magnitude[i] = std::max(samples.sums.magnitude[i], other.sums.magnitude[i]);
}

/// SSIM's kernels take moments of a - 1/2 and b - 1/2 (kPivot of losses/similarity.glsl), which black images
/// make as large as white ones: roundings are at least those of the images moved by the pivot.
CaseReference with_magnitudes_about_gray(const OpCase& op_case) {
    CaseReference reference = bench::sampled_reference_of(op_case);
    OpCase moved = op_case;
    for (CaseTensor& input : moved.inputs)
        for (float& value : input.values) value -= 0.5F;
    const CaseReference about = bench::sampled_reference_of(moved);
    for (std::size_t i = 0; i < reference.outputs.size(); ++i)
        widen(reference.outputs[i], about.outputs[i]);
    for (std::size_t i = 0; i < reference.grad_inputs.size(); ++i)
        widen(reference.grad_inputs[i], about.grad_inputs[i]);
    return reference;
}

}  // namespace

CaseReference reference_about_pivots(const OpCase& op_case) {
    OpCase moved = op_case;
    for (CaseTensor& input : moved.inputs)
        for (float& value : input.values)  // the limit
            if (std::isinf(value)) value = std::copysign(std::numeric_limits<float>::max(), value);
    if (op_case.op == "ssim") return with_magnitudes_about_gray(moved);
    std::vector<float>& x = moved.inputs[0].values;
    const auto& dims = moved.inputs[0].dims;
    const auto images = static_cast<std::size_t>(dims[0]);
    if (op_case.op == "group_norm") {
        const auto groups = op_case.attributes.at("groups").get<std::size_t>();
        const std::size_t each = x.size() / (images * groups);
        for (std::size_t first = 0; first < x.size(); first += each)
            take_about_pivot(x, first, each, 1);
    }
    if (op_case.op == "layer_norm") {
        const auto channels = static_cast<std::size_t>(dims[1]);
        const std::size_t pixels = x.size() / (images * channels);
        for (std::size_t i = 0; i < images * pixels; ++i)
            take_about_pivot(x, i / pixels * channels * pixels + i % pixels, channels, pixels);
    }
    return bench::sampled_reference_of(moved);
}

}  // namespace vkrun::stress

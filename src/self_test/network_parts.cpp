#include <algorithm>

#include "ops/conv2d.h"
#include "ops/group_norm.h"
#include "ops/linear.h"
#include "ref/conv2d_ref.h"
#include "ref/group_norm_ref.h"
#include "ref/linear_ref.h"
#include "self_test/parts.h"

namespace splat::self_test {
namespace {

/// A convolution with `r` x `r` taps of h x w pixels, c channels to k, and its gradients, by the definition.
struct Convolution {
    std::size_t c, k, h, w, r;
    int winograd;  ///< F(2x2), which is exact for integers; 0: directly

    [[nodiscard]] std::size_t p() const { return h * w; }
    ops::Conv2dDesc desc{1,
                         static_cast<std::uint32_t>(c),
                         static_cast<std::uint32_t>(h),
                         static_cast<std::uint32_t>(w),
                         static_cast<std::uint32_t>(k),
                         static_cast<std::uint32_t>(r),
                         true,
                         1,
                         winograd};
    Floats x = integers(c * p(), 7), weight = integers(k * c * r * r, 8), bias = integers(k, 9);
    Floats grad_y = integers(k * p(), 10);

    ref::Conv2dInput<double> reference{{1, c, h, w, k, r}, 1,          wide(x),
                                       wide(weight),       wide(bias), {}};
};

/// Odd sizes, and such as fill tiles of 64 channels.
constexpr struct {
    std::size_t c, k, h, w, r;
    int winograd;
} kConvolutions[] = {
    {12, 20, 10, 12, 3, 2}, {64, 64, 5, 8, 3, 2}, {64, 64, 5, 8, 3, 0}, {64, 64, 5, 8, 1, 0}};

Result<vk::BufferView> prepared_weight(Trial& trial, const Convolution& of, bool transposed) {
    SPLAT_ASSIGN(const vk::BufferView weight, trial.put(of.weight));
    const std::uint64_t bytes = ops::conv2d_prepared_bytes(trial.recorder(), of.desc, transposed);
    if (bytes == 0) return weight;
    SPLAT_ASSIGN(const vk::BufferView prepared, trial.room(bytes));
    SPLAT_TRY(ops::conv2d_prepare_weight(trial.recorder(), of.desc, weight, prepared, transposed));
    return prepared;
}

/// 16 channels in 4 groups of 63 pixels.
struct Norm {
    static constexpr std::size_t kC = 16, kP = 63;
    ops::GroupNormDesc desc{{1, kC, kP}, 4, 1e-6F, false};
    Floats x = integers(kC * kP, 4), gamma = integers(kC, 5), beta = integers(kC, 6);
    Floats grad_y = integers(kC * kP, 11);
    ref::GroupNormInput<double> reference{{1, kC, kP, 4}, 1e-6,        false,
                                          wide(x),        wide(gamma), wide(beta)};
};

struct NormViews {
    vk::BufferView x, gamma, beta, mean, rstd, y;
};

Result<NormViews> record_norm(Trial& trial, const Norm& norm) {
    NormViews at;
    SPLAT_ASSIGN(at.x, trial.put(to_quads(norm.x, Norm::kC, Norm::kP)));
    SPLAT_ASSIGN(at.gamma, trial.put(norm.gamma));
    SPLAT_ASSIGN(at.beta, trial.put(norm.beta));
    SPLAT_ASSIGN(at.y, trial.room(Norm::kC * Norm::kP * 4));
    SPLAT_ASSIGN(at.mean, trial.room(32));  // [2,1,4]
    SPLAT_ASSIGN(at.rstd, trial.room(16));
    SPLAT_TRY(ops::group_norm_forward(trial.recorder(), norm.desc, at.x, at.gamma, at.beta, at.y,
                                      at.mean, at.rstd));
    return at;
}

}  // namespace

/// 37 rows of 28 features to 19.
Result<double> linear_error(vk::Context& context) {
    const ops::LinearDesc desc{37, 28, 19, true, 1};
    const Floats x = integers(28 * 37, 1), weight = integers(19 * 28, 2), bias = integers(20, 3);
    Trial trial(context);
    SPLAT_ASSIGN(const vk::BufferView at_x, trial.put(to_quads(x, 28, 37)));
    SPLAT_ASSIGN(vk::BufferView at_weight, trial.put(weight));
    SPLAT_ASSIGN(const vk::BufferView at_bias, trial.put(bias));
    SPLAT_ASSIGN(const vk::BufferView y, trial.room(20 * 37 * 4));
    const std::uint64_t bytes = ops::linear_packed_bytes(trial.recorder(), desc, false);
    if (bytes != 0) {
        SPLAT_ASSIGN(const vk::BufferView packed, trial.room(bytes));
        SPLAT_TRY(ops::linear_pack_weight(trial.recorder(), desc, at_weight, packed, false));
        at_weight = packed;
    }
    SPLAT_TRY(ops::linear_forward(trial.recorder(), desc, at_x, at_weight, at_bias, y));
    SPLAT_TRY(trial.run());
    Floats rows(x.size());  // [rows,in] of the columns
    for (std::size_t i = 0; i < x.size(); ++i) rows[i % 37 * 28 + i / 37] = x[i];
    const Doubles y_rows =
        ref::linear_forward<double>(
            {{37, 28, 19}, wide(rows), wide(weight), wide(Floats(bias.begin(), bias.end() - 1))})
            .value;
    Doubles expected(y_rows.size());
    for (std::size_t i = 0; i < expected.size(); ++i) expected[i] = y_rows[i % 37 * 19 + i / 37];
    return trial.error(y, 19, 37, expected);
}

Result<double> convolution_error(vk::Context& context) {
    double most = 0;
    for (const auto& [c, k, h, w, r, winograd] : kConvolutions) {
        const Convolution of{c, k, h, w, r, winograd};
        const Doubles expected = ref::conv2d_forward(of.reference).value;
        Trial trial(context);
        SPLAT_ASSIGN(const vk::BufferView x, trial.put(to_quads(of.x, c, of.p())));
        SPLAT_ASSIGN(const vk::BufferView weight, prepared_weight(trial, of, false));
        SPLAT_ASSIGN(const vk::BufferView bias, trial.put(of.bias));
        SPLAT_ASSIGN(const vk::BufferView y, trial.room(expected.size() * 4));
        SPLAT_ASSIGN(const vk::BufferView space,
                     trial.room(ops::conv2d_forward_bytes(trial.recorder(), of.desc)));
        SPLAT_TRY(ops::conv2d_forward(trial.recorder(), of.desc, x, weight, bias, {}, y, space));
        SPLAT_TRY(trial.run());
        SPLAT_ASSIGN(const double error, trial.error(y, k, of.p(), expected));
        most = std::max(most, error);
    }
    return most;
}

Result<double> convolution_gradient_error(vk::Context& context) {
    double most = 0;
    for (const auto& [c, k, h, w, r, winograd] : kConvolutions) {
        const Convolution of{c, k, h, w, r, winograd};
        const auto expected = ref::conv2d_backward(of.reference, wide(of.grad_y));
        const Doubles& by_x = expected.grad_x.value;
        const Doubles& by_weight = expected.grad_weight.value;
        Trial trial(context);
        SPLAT_ASSIGN(const vk::BufferView x, trial.put(to_quads(of.x, c, of.p())));
        SPLAT_ASSIGN(const vk::BufferView grad_y, trial.put(to_quads(of.grad_y, k, of.p())));
        SPLAT_ASSIGN(const vk::BufferView weight, prepared_weight(trial, of, true));
        SPLAT_ASSIGN(const vk::BufferView grad_x, trial.room(by_x.size() * 4));
        SPLAT_ASSIGN(const vk::BufferView grad_weight, trial.room(by_weight.size() * 4));
        SPLAT_ASSIGN(
            const vk::BufferView space,
            trial.room(std::max(ops::conv2d_backward_input_bytes(trial.recorder(), of.desc),
                                ops::conv2d_backward_weight_bytes(trial.recorder(), of.desc))));
        SPLAT_TRY(ops::conv2d_backward_begin(trial.recorder(), of.desc, grad_y, space));
        SPLAT_TRY(
            ops::conv2d_backward_input(trial.recorder(), of.desc, weight, grad_y, grad_x, space));
        SPLAT_TRY(ops::conv2d_backward_weight(trial.recorder(), of.desc, x, grad_y, grad_weight,
                                              space, false));
        SPLAT_TRY(trial.run());
        SPLAT_ASSIGN(const double error, trial.error(grad_x, c, of.p(), by_x));
        SPLAT_ASSIGN(const Floats got, trial.get(grad_weight, by_weight.size()));
        most = std::max({most, error, distance(got, by_weight)});
    }
    return most;
}

Result<double> group_norm_error(vk::Context& context) {
    const Norm norm;
    const Doubles expected = ref::group_norm_forward(norm.reference).y.value;
    Trial trial(context);
    SPLAT_ASSIGN(const NormViews at, record_norm(trial, norm));
    SPLAT_TRY(trial.run());
    SPLAT_ASSIGN(const double error, trial.error(at.y, Norm::kC, Norm::kP, expected));
    return error / 20;  // the values reach 20
}

Result<double> group_norm_gradient_error(vk::Context& context) {
    const Norm norm;
    const auto expected = ref::group_norm_backward(norm.reference, wide(norm.grad_y));
    const Doubles& by_x = expected.grad_x.value;
    const Doubles& by_gamma = expected.grad_gamma.value;
    Trial trial(context);
    SPLAT_ASSIGN(const NormViews at, record_norm(trial, norm));
    SPLAT_ASSIGN(const vk::BufferView grad_y, trial.put(to_quads(norm.grad_y, Norm::kC, Norm::kP)));
    SPLAT_ASSIGN(const vk::BufferView grad_x, trial.room(by_x.size() * 4));
    SPLAT_ASSIGN(const vk::BufferView grad_gamma, trial.room(Norm::kC * 4));
    SPLAT_ASSIGN(const vk::BufferView grad_beta, trial.room(Norm::kC * 4));
    SPLAT_ASSIGN(const vk::BufferView sums, trial.room(ops::group_norm_sums_bytes(norm.desc)));
    SPLAT_TRY(ops::group_norm_backward(trial.recorder(), norm.desc, at.x, at.gamma, at.beta,
                                       at.mean, at.rstd, grad_y, grad_x, grad_gamma, grad_beta,
                                       sums, false));
    SPLAT_TRY(trial.run());
    SPLAT_ASSIGN(const double error, trial.error(grad_x, Norm::kC, Norm::kP, by_x));
    SPLAT_ASSIGN(const Floats got, trial.get(grad_gamma, Norm::kC));
    return std::max(error / 20, distance(got, by_gamma) / 200);  // the values reach 20 and 200
}

}  // namespace splat::self_test

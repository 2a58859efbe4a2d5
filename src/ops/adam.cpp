#include "ops/adam.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "ops/quads.h"

namespace splat::ops {
namespace {

bool is_beta(double beta) {
    return beta >= 0 && beta < 1;
}

}  // namespace

Status adam_check(const AdamDesc& desc) {
    if (desc.step == 0) return invalid("adam: step is 0, expected a number from 1 on");
    if (!is_beta(desc.beta1) || !is_beta(desc.beta2))
        return invalid("adam: betas are %g and %g, expected at least 0 and less than 1", desc.beta1,
                       desc.beta2);
    if (!std::isfinite(desc.learning_rate) || desc.learning_rate < 0)
        return invalid("adam: learning_rate is %g, expected a finite number of 0 or more",
                       desc.learning_rate);
    if (!std::isfinite(desc.eps) ||
        desc.eps < static_cast<double>(std::numeric_limits<float>::min()))
        return invalid("adam: eps is %g, expected a float > 0", desc.eps);
    return {};
}

Result<std::array<float, 8>> adam_scalars(const AdamDesc& desc) {
    SPLAT_TRY(adam_check(desc));
    const auto step = static_cast<double>(desc.step);
    const auto real = [](double value) { return static_cast<float>(value); };
    return std::array<float, 8>{real(desc.beta1),
                                real(1 - desc.beta1),
                                real(desc.beta2),
                                real(1 - desc.beta2),
                                real(desc.learning_rate / (1 - std::pow(desc.beta1, step))),
                                real(1 / std::sqrt(1 - std::pow(desc.beta2, step))),
                                real(desc.eps),
                                0};
}

Status adam(vk::Recorder& recorder, const AdamScalars& scalars, const vk::BufferView& value,
            const vk::BufferView& grad, const vk::BufferView& m, const vk::BufferView& v) {
    if (grad.bytes != value.bytes || m.bytes != value.bytes || v.bytes != value.bytes)
        return error(
            Code::kShape,
            "adam: blocks of %llu, %llu, %llu and %llu bytes (value, grad, m, v), expected "
            "the same length",
            llu(value.bytes), llu(grad.bytes), llu(m.bytes), llu(v.bytes));
    const double bytes = static_cast<double>(value.bytes);
    return record_each(
        recorder,
        {.kernel = "adam",
         .items = value.bytes / 16,
         .accesses = {vk::read(value), vk::read(grad), vk::read(m), vk::read(v), vk::write(value),
                      vk::write(m), vk::write(v), vk::read(scalars.values)},
         .work = {.flops = 3 * bytes, .bytes = 7 * bytes},
         .may_alias = true},  // an element is written by the invocation that read it
        [&](std::uint32_t groups_x) {
            return params::AdamParams{static_cast<std::uint32_t>(value.bytes / 16), groups_x,
                                      scalars.rule};
        });
}

Status step_decision(vk::Recorder& recorder, const StepDecision& views) {
    const auto quads = [](std::uint64_t bytes) { return static_cast<std::uint32_t>(bytes / 16); };
    const std::uint32_t entry = 2 * views.rules + 1;
    const std::uint32_t chunks = quads(views.partial.bytes) / 2;
    const std::uint32_t size =
        vk::workgroup_size(recorder.device(), 256, std::max(chunks, quads(views.notes.bytes)));
    const auto bytes = static_cast<double>(views.partial.bytes + 2 * views.notes.bytes);
    return recorder.dispatch({
        .op = "step_decision",
        .shader = "step_decision",
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params::StepDecisionParams{chunks, quads(views.notes.bytes), quads(views.checked),
                                           quads(views.block), quads(views.unchecked),
                                           (quads(views.inputs.bytes) - 1) / entry, entry,
                                           quads(views.ema_at)},
        .accesses = {vk::read(views.partial), vk::read(views.notes), vk::read(views.inputs),
                     vk::read_write(views.history), vk::write(views.scalars)},
        .groups = {1, 1, 1},
        .work = {.flops = bytes, .bytes = bytes},
    });
}

}  // namespace splat::ops

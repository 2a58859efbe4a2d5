#include "ops/adam.h"

#include <cmath>
#include <limits>

#include "vk/launch.h"

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

params::AdamParams adam_params(const vk::DeviceInfo& device, const AdamDesc& desc,
                               std::uint64_t bytes) {
    const std::uint64_t quads = bytes / 16;
    const auto step = static_cast<double>(desc.step);
    const auto real = [](double value) { return static_cast<float>(value); };
    return {static_cast<std::uint32_t>(quads),
            vk::groups_for(device, quads, vk::workgroup_size(device, 64))[0],
            real(desc.beta1),
            real(1 - desc.beta1),
            real(desc.beta2),
            real(1 - desc.beta2),
            real(desc.learning_rate / (1 - std::pow(desc.beta1, step))),
            real(1 / std::sqrt(1 - std::pow(desc.beta2, step))),
            real(desc.eps)};
}

Status adam(vk::Recorder& recorder, const AdamDesc& desc, const vk::BufferView& value,
            const vk::BufferView& grad, const vk::BufferView& m, const vk::BufferView& v) {
    SPLAT_TRY(adam_check(desc));
    if (grad.bytes != value.bytes || m.bytes != value.bytes || v.bytes != value.bytes)
        return error(
            Code::kShape,
            "adam: blocks of %llu, %llu, %llu and %llu bytes (value, grad, m, v), expected "
            "the same length",
            llu(value.bytes), llu(grad.bytes), llu(m.bytes), llu(v.bytes));
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const double bytes = static_cast<double>(value.bytes);
    return recorder.dispatch({
        .op = "adam",
        .shader = "adam",
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = adam_params(recorder.device(), desc, value.bytes),
        .accesses = {vk::read(value), vk::read(grad), vk::read(m), vk::read(v), vk::write(value),
                     vk::write(m), vk::write(v)},
        .groups = vk::groups_for(recorder.device(), value.bytes / 16, size),
        .work = {.flops = 3 * bytes, .bytes = 7 * bytes},
        .may_alias = true,  // an element is written by the invocation that read it
    });
}

}  // namespace splat::ops

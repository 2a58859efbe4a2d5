#include "ops/activations/activation.h"

#include "ops/quads.h"
#include "params/activation_params.h"

namespace splat::ops {
namespace {

Status record_activation(vk::Recorder& recorder, const char* kernel, const Shape& shape,
                         std::vector<vk::Access> accesses, double flops,
                         const ActivationNumbers& numbers) {
    SPLAT_ASSIGN(const QuadDims dims, quad_dims(shape, 1));
    const double bytes = static_cast<double>(dims.bytes());
    const double tensors = static_cast<double>(accesses.size());
    return record_each(recorder,
                       {.kernel = kernel,
                        .items = dims.quads(),
                        .accesses = std::move(accesses),
                        .work = {.flops = flops * bytes / 4, .bytes = tensors * bytes},
                        .may_alias = true},
                       [&](std::uint32_t groups_x) {
                           return params::ActivationParams{static_cast<std::uint32_t>(dims.quads()),
                                                           groups_x,
                                                           numbers.form,
                                                           dims.c,
                                                           dims.n * dims.p,
                                                           numbers.least,
                                                           numbers.most};
                       });
}

}  // namespace

Result<OpPlan> activation_plan(const vk::Recorder&, const Attributes&,
                               std::span<const Shape> inputs) {
    SPLAT_TRY(quad_dims(inputs[0], 1).status());
    return OpPlan{.outputs = {inputs[0]}};
}

Status activation_forward(vk::Recorder& recorder, const char* kernel, const OpViews& v,
                          double flops, const ActivationNumbers& numbers) {
    return record_activation(recorder, kernel, v.inputs[0].shape,
                             {vk::read(v.inputs[0]), vk::write(v.outputs[0])}, flops, numbers);
}

Status activation_backward(vk::Recorder& recorder, const char* kernel, const OpViews& v,
                           double flops, const ActivationNumbers& numbers) {
    if (!present(v.grad_inputs[0])) return {};
    return record_activation(
        recorder, kernel, v.inputs[0].shape,
        {vk::read(v.inputs[0]), vk::read(v.grad_outputs[0]), vk::write(v.grad_inputs[0])}, flops,
        numbers);
}

}  // namespace splat::ops

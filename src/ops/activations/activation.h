#pragma once

#include "ops/op_table.h"

/// Shared by operators that map each element separately: one kernel of shaders/ops/activations per pass, y
/// from x, and grad_x from x and grad_y.
namespace splat::ops {

Result<OpPlan> activation_plan(const vk::Recorder& recorder, const Attributes& attributes,
                               std::span<const Shape> inputs);

/// What kernels take besides the tensors (ActivationParams).
struct ActivationNumbers {
    std::uint32_t form = 0;
    float least = 0;
    float most = 0;
};

/// Record a kernel of `flops` per element. Errors: the recorder's.
Status activation_forward(vk::Recorder& recorder, const char* kernel, const OpViews& v,
                          double flops, const ActivationNumbers& numbers = {});
Status activation_backward(vk::Recorder& recorder, const char* kernel, const OpViews& v,
                           double flops, const ActivationNumbers& numbers = {});

}  // namespace splat::ops

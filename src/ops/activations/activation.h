#pragma once

#include "ops/op_table.h"

/// Shared by operators that map each element separately: one kernel of shaders/ops/activations per pass, y
/// from x, and grad_x from x and grad_y.
namespace splat::ops {

Result<OpPlan> activation_plan(const vk::Recorder& recorder, const Attributes& attributes,
                               std::span<const Shape> inputs);

/// Record a kernel of `flops` per element, of the operator's formula `form`. Errors: the recorder's.
Status activation_forward(vk::Recorder& recorder, const char* kernel, const OpViews& v,
                          double flops, std::uint32_t form = 0);
Status activation_backward(vk::Recorder& recorder, const char* kernel, const OpViews& v,
                           double flops, std::uint32_t form = 0);

}  // namespace splat::ops

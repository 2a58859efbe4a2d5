#pragma once

#include "ops/quads.h"

namespace splat::ops {

/// Record a kernel of shaders/ops that maps each element on its own (silu, relu): `accesses` in the order
/// of its bindings, `flops` per element.
Status record_activation(vk::Recorder& recorder, const char* op, const char* shader,
                         const QuadDims& dims, std::vector<vk::Access> accesses, double flops);

}  // namespace splat::ops

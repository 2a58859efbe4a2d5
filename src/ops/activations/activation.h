#pragma once

#include "ops/quads.h"

namespace splat::ops {

/// Records a kernel of shaders/ops that maps each element by itself (silu, relu): `accesses` in the
/// order of its bindings, `flops` per element.
Status record_activation(vk::Recorder& recorder, const char* op, const char* shader,
                         const QuadDims& dims, std::vector<vk::Access> accesses, double flops);

}  // namespace splat::ops

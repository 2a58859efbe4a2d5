#pragma once

#include "bench/ops/op_case.h"
#include "stress/stress.h"

namespace vkrun::stress {

/// The bound's derivation in words.
extern const char* const kOpReason;

/// A case's result with its bound. `flushed`: the float64 result of with_denormals_zeroed(), if that is another case.
Expected expected_op(const bench::OpCase& op_case, const splat::ref::Summed<double>& sums,
                     const splat::ref::Summed<double>* flushed);

/// The case with zeros, of the same sign, in place of inputs and gradients below 2^-126: Vulkan lets devices flush
/// these, unless a shader asks for shaderDenormPreserveFloat32, which no kernel does.
bench::OpCase with_denormals_zeroed(const bench::OpCase& op_case);

/// True if an input or a gradient differs.
bool has_other_values(const bench::OpCase& a, const bench::OpCase& b);

}  // namespace vkrun::stress

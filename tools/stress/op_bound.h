#pragma once

#include "vkrun/doctor/op_case.h"
#include "stress/stress.h"

namespace vkrun::stress {

/// The bound's derivation in words.
extern const char* const kOpReason;

/// A case's result with its bound. `flushed`: the float64 result of with_denormals_zeroed(), if that is another case.
Expected expected_op(const OpCase& op_case, const splat::ref::Summed<double>& sums,
                     const splat::ref::Summed<double>* flushed);

/// The case with zeros, of the same sign, in place of inputs and gradients below 2^-126: Vulkan lets devices flush
/// these, unless a shader asks for shaderDenormPreserveFloat32, which no kernel does.
OpCase with_denormals_zeroed(const OpCase& op_case);

/// True if an input or a gradient differs.
bool has_other_values(const OpCase& a, const OpCase& b);

}  // namespace vkrun::stress

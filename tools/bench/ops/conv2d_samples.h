#pragma once

#include "bench/ops/op_case.h"

namespace vkrun::bench {

/// The float64 results of a conv2d case at 256 elements of each tensor, the first and the last among
/// them: all elements would take minutes.
CaseReference conv2d_samples(const OpCase& op_case);

}  // namespace vkrun::bench

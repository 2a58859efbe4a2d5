#pragma once

#include "bench/ops/op_case.h"

namespace vkrun::bench {

/// The float64 results of a conv2d case at a few hundred elements of each tensor, corners first: all of
/// them would take minutes.
CaseReference conv2d_samples(const OpCase& op_case);

}  // namespace vkrun::bench

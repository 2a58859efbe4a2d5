#pragma once

#include "vkrun/doctor/op_case.h"

namespace vkrun::bench {

/// reference_of(); for conv2d at 256 elements of each tensor, the first and the last among them: all elements
/// would take minutes.
CaseReference sampled_reference_of(const OpCase& op_case);

}  // namespace vkrun::bench

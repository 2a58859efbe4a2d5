#pragma once

#include <string>
#include <vector>

#include "stress/op_families.h"

namespace vkrun::stress {

/// Families that only this operator has: what its formula is sensitive to.
std::vector<OpStress> own_families(const std::string& op, bool quick);

}  // namespace vkrun::stress

#pragma once

#include <string>
#include <vector>

#include "vkrun/doctor/op_case.h"

namespace vkrun::stress {

/// One operator on one family of inputs.
struct OpStress {
    std::string name;   ///< "silu/magnitude_1e30"
    std::string input;  ///< in words
    OpCase op_case;
};

/// Families that any operator has (its smallest benchmark with changed values), and those made for this one.
std::vector<OpStress> op_families(const std::string& op, bool quick);

/// reference_of(), with x of group_norm and layer_norm taken about a float32 number near the mean of its group or of
/// its pixel. The values are the same, and x minus that number is exact, so that the magnitudes, and with them the
/// bounds, are those of statistics about a pivot. An infinite number counts as the largest one.
CaseReference reference_about_pivots(const OpCase& op_case);

}  // namespace vkrun::stress

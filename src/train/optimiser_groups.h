#pragma once

#include <span>
#include <string_view>

#include "train/optimiser.h"

namespace splat::train {

/// Parameters by their names. A number that is 0 is that of parameters without a group.
struct OptimiserGroup {
    std::string pattern;
    double rate_factor = 0;
    std::array<double, 2> betas = {0, 0};
    double eps = 0;
};

/// True if a name has the pattern, in which '*' stands for any text and '?' for one character.
bool matches_pattern(std::string_view pattern, std::string_view name);

/// Make the rules of `desc`: `base`, and one for each group. The first group that matches a parameter's name
/// has it.
///
/// Errors: kInvalidArgument for a group without effect, because its pattern matches no name, or only names
/// of groups before it, or because it sets no number and keeps no parameter from a later group.
Status apply_groups(OptimiserDesc& desc, const OptimiserRule& base,
                    std::span<const OptimiserGroup> groups);

/// The parameters whose names have the pattern. Errors: kInvalidArgument if there are none.
Result<std::vector<std::size_t>> find_parameters(std::span<const OptimiserParameter> parameters,
                                                 std::string_view pattern);

/// Errors: kInvalidArgument for no parameters, two of one name, or two with common memory.
Status check_distinct(const OptimiserDesc& desc);

}  // namespace splat::train

#pragma once

#include <cstddef>
#include <span>

#include "core/finite.h"
#include "core/status.h"

namespace splat::prior_scores {

/// Errors: kShape unless the map has `count` numbers, at least one; kInvalidArgument for a number that is not
/// finite. `name` names the map in messages, `remedy` says what to do.
inline Status check_map(std::span<const float> map, std::size_t count, const char* name,
                        const char* remedy = "") {
    if (count == 0 || map.size() != count)
        return error(Code::kShape, "%s has %zu numbers, expected %zu, and at least one", name,
                     map.size(), count);
    const std::size_t bad = find_not_finite(map);
    if (bad == count) return {};
    return invalid("%s is %g at number %zu, expected finite numbers%s", name,
                   static_cast<double>(map[bad]), bad, remedy);
}

/// The same for a map of numbers from 0 to 1.
inline Status check_unit_map(std::span<const float> map, std::size_t count, const char* name) {
    SPLAT_TRY(check_map(map, count, name));
    for (std::size_t i = 0; i < count; ++i)
        if (map[i] < 0 || map[i] > 1)
            return invalid("%s is %g at number %zu, expected 0 to 1", name,
                           static_cast<double>(map[i]), i);
    return {};
}

}  // namespace splat::prior_scores

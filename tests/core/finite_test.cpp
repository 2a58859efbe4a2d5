#include "core/finite.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace splat {
namespace {

TEST(FindNotFinite, SaysWhereTheFirstIs) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    // Around the blocks of 256 that are checked together.
    for (const std::size_t count : {0U, 1U, 255U, 256U, 257U, 511U, 512U, 700U}) {
        std::vector<float> values(count, std::numeric_limits<float>::max());
        EXPECT_EQ(find_not_finite(values), count);
        for (std::size_t at = count; at-- > 0;) {
            values[at] = at % 3 == 0   ? std::numeric_limits<float>::quiet_NaN()
                         : at % 3 == 1 ? kInfinity
                                       : -kInfinity;
            ASSERT_EQ(find_not_finite(values), at) << count;
            values[at] = 0;
        }
        if (count < 2) continue;
        values[count - 2] = values[count - 1] = kInfinity;
        EXPECT_EQ(find_not_finite(values), count - 2);
    }
}

}  // namespace
}  // namespace splat

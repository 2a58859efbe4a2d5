#include "core/large_vector.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <numeric>

namespace splat {
namespace {

TEST(LargeVector, HoldsItsNumbersAtEverySize) {
    // Around 64 KiB and 2 MiB, where the kind of memory changes.
    for (const std::size_t count :
         {0U, 1U, 16383U, 16384U, 16385U, 524287U, 524288U, 525312U, 1300000U}) {
        LargeVector<float> values;
        values.resize(count);
        std::iota(values.begin(), values.end(), 0.0F);
        const auto at = reinterpret_cast<std::uintptr_t>(values.data());
        EXPECT_TRUE(count * sizeof(float) < kLargePageBytes || at % kLargePageBytes == 0) << count;
        LargeVector<float> grown = values;
        EXPECT_EQ(grown, values);
        grown.resize(count + 70000, -1);
        EXPECT_EQ(grown.back(), -1);
        grown.resize(count);
        const std::vector<float> plain = grown;
        EXPECT_EQ(LargeVector<float>(plain), values) << count;
    }
    EXPECT_FALSE(LargeVector<float>(3, 1) == LargeVector<float>(3, 2));
    EXPECT_FALSE(LargeVector<float>(3, 1) == LargeVector<float>(4, 1));
}

}  // namespace
}  // namespace splat

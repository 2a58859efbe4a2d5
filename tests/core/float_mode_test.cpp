#include "core/float_mode.h"

#include <gtest/gtest.h>

#include <cfloat>
#include <cmath>
#include <cstdint>
#if defined(__x86_64__) || defined(_M_X64)
#include <xmmintrin.h>
#endif

namespace splat {
namespace {

/// Numbers below the least normal one become 0 in this thread. False where the processor cannot.
bool flush_subnormals() {
#if defined(__x86_64__) || defined(_M_X64)
    _mm_setcsr(_mm_getcsr() | 0x8040U);
    return true;
#elif defined(__aarch64__)
    std::uint64_t control = 0;
    __asm__ volatile("mrs %0, fpcr" : "=r"(control));
    __asm__ volatile("msr fpcr, %0" : : "r"(control | std::uint64_t{1} << 24U));
    return true;
#else
    return false;
#endif
}

/// Volatile numbers keep the compiler from computing in another mode than the one that is set.
float half_of_least() {
    volatile float half = FLT_MIN;
    half = half / 2;
    return half;
}

TEST(FloatMode, KeepsSubnormalsForACallerThatFlushesThem) {
    if (!flush_subnormals()) GTEST_SKIP() << "no mode of the processor is known";
    const float before = half_of_least();
    float within = 0;
    {
        const FloatMode mode;
        within = half_of_least();
    }
    const float after = half_of_least();
    std::fesetenv(FE_DFL_ENV);
    EXPECT_EQ(before, 0.0F);
    EXPECT_EQ(within, FLT_MIN / 2);
    EXPECT_EQ(after, 0.0F) << "the caller's mode is back";
    EXPECT_EQ(half_of_least(), FLT_MIN / 2);
}

#if defined(_WIN32) && defined(__x86_64__)
std::uint16_t x87() {
    std::uint16_t mode = 0;
    __asm__ volatile("fnstcw %0" : "=m"(mode));
    return mode;
}

/// 53 bits are what programs of other compilers have, and threads.
TEST(FloatMode, ExponentialsHaveTheBitsThatTheyNeed) {
    const std::uint16_t before = x87(), others = 0x027F;
    __asm__ volatile("fldcw %0" : : "m"(others));
    volatile double x = -0.375;
    double within = 0;
    {
        const FloatMode mode;
        EXPECT_EQ(x87(), 0x037F);
        within = std::exp(x);
    }
    EXPECT_EQ(x87(), others) << "the caller's mode is back";
    __asm__ volatile("fldcw %0" : : "m"(before));
    EXPECT_EQ(within, 0x1.5fe4615e98e8fp-1)
        << "as glibc has it; its last bit is another at 53 bits";
}
#endif

/// Fused, the square of 1 + 2^-27 would keep its last bit, 2^-54.
TEST(FloatMode, ProductsAreRoundedBeforeSums) {
    volatile double x = 1 + 0x1p-27, sum = -(1 + 0x1p-26);
    EXPECT_EQ(x * x + sum, 0.0);
}

}  // namespace
}  // namespace splat

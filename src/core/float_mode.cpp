#include "core/float_mode.h"

#include <cstdint>

namespace splat {
namespace {

/// True if this thread's mode is that of a C program's start. A save and a restore cost ten times as much.
bool is_default() {
#if defined(__x86_64__)
    std::uint32_t sse = 0;
    std::uint16_t x87 = 0;  // printf and strtod round as it says
    __asm__ volatile("stmxcsr %0\n\tfnstcw %1" : "=m"(sse), "=m"(x87));
    constexpr std::uint32_t kExceptionsFound = 0x3F;
    constexpr std::uint16_t kPrecision = 0x1300;  // the infinity bit of it has no effect
    return (sse & ~kExceptionsFound) == 0x1F80 && (x87 & ~kPrecision) == 0x007F;
#elif defined(__aarch64__)
    std::uint64_t control = 0;
    __asm__ volatile("mrs %0, fpcr" : "=r"(control));
    return control == 0;
#else
    return false;
#endif
}

}  // namespace

FloatMode::FloatMode() noexcept : differs_(!is_default()) {
    if (!differs_) return;
    std::fegetenv(&callers_);
    std::fesetenv(FE_DFL_ENV);
}

}  // namespace splat

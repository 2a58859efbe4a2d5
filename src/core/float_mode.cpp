#include "core/float_mode.h"

#include <cstdint>

namespace splat {
namespace {

#if defined(__x86_64__)
/// The control word of the x87 unit: 0x0300 is the precision, 0x1000 has no effect.
constexpr std::uint16_t kX87 = 0x037F;
#if defined(_WIN32)
// Threads start with 53 bits there, and only mingw's start of a program sets the 64 that exp() and pow() of its C
// library need for their last bit.
constexpr std::uint16_t kX87Free = 0x1000;
#else
constexpr std::uint16_t kX87Free = 0x1300;
#endif
#endif

/// True if this thread's mode is that of a C program's start. A save and a restore cost ten times as much.
bool is_default() {
#if defined(__x86_64__)
    std::uint32_t sse = 0;
    std::uint16_t x87 = 0;  // printf and strtod round as it says
    __asm__ volatile("stmxcsr %0\n\tfnstcw %1" : "=m"(sse), "=m"(x87));
    constexpr std::uint32_t kExceptionsFound = 0x3F;
    return (sse & ~kExceptionsFound) == 0x1F80 && ((x87 ^ kX87) & ~kX87Free) == 0;
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
#if defined(_WIN32) && defined(__x86_64__)
    __asm__ volatile("fldcw %0" : : "m"(kX87));  // FE_DFL_ENV may mean the C library's 53 bits
#endif
}

}  // namespace splat

#pragma once

#include <cstdint>

/// Named places where a test can make the environment fail. Compiled out (constant false) unless
/// SPLAT_FAULT_POINTS is 1.
///
///     if (SPLAT_FAULT("vk.allocate_memory")) return VK_ERROR_OUT_OF_DEVICE_MEMORY;
#if SPLAT_FAULT_POINTS
#define SPLAT_FAULT(name) (::splat::fault::hit(name))
#else
#define SPLAT_FAULT(name) (false)
#endif

namespace splat::fault {

#if SPLAT_FAULT_POINTS
inline constexpr std::uint64_t kForever = ~std::uint64_t{0};

/// Make hits first, first + 1, … first + count - 1 (counted from 1) of point `name` fail, on all
/// threads. A nullptr name counts the hits of all points together.
void arm(const char* name, std::uint64_t first, std::uint64_t count = kForever);

/// Stop failing. Returns the hits since arm().
std::uint64_t disarm();

/// Count a hit of point `name`; true if it must fail.
bool hit(const char* name);
#endif

}  // namespace splat::fault

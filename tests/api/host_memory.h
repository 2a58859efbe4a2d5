#pragma once

#include <cstddef>
#include <cstdint>

/// Host memory that runs out on request. Linking host_memory.cpp replaces the global operator new.
///
/// Counts only allocations of the library: the caller is code of this program, directly or through
/// libstdc++, and not a driver, a layer or the driver's compiler, which call operator new too.
/// Counts only on the watching thread, between watch() and unwatch(), so put these right around the
/// call into the library.
namespace splat::test::host_memory {

inline constexpr std::uint64_t kForever = ~std::uint64_t{0};

/// Make allocations first to first + count - 1 fail, counting from 1 and from now on.
void fail(std::uint64_t first, std::uint64_t count = kForever);

/// Stop failing and restart the count.
void fail_none();

/// Allocations seen, and failed, since fail() or fail_none().
std::uint64_t seen();
std::uint64_t failed();

void watch();
void unwatch();

/// Allocations of the whole run that have not been freed.
std::size_t live();

}  // namespace splat::test::host_memory

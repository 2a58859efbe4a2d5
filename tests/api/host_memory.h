#pragma once

#include <cstddef>
#include <cstdint>

/// Host memory that runs out on request. Linking host_memory.cpp replaces the global operator new.
///
/// Only allocations of the library count: those whose caller is code of this program, at once or
/// through libstdc++; not those of drivers, layers and the compiler inside the driver, which call
/// operator new too. Only on the thread that watches, and only while it does; so put watch() and
/// unwatch() right around the call into the library.
namespace splat::test::host_memory {

inline constexpr std::uint64_t kForever = ~std::uint64_t{0};

/// From now on the allocations number first, first + 1, ... first + count - 1 (counted from 1)
/// fail.
void fail(std::uint64_t first, std::uint64_t count = kForever);

/// Stop failing and counting anew.
void fail_none();

/// Allocations seen, and failed, since fail() or fail_none().
std::uint64_t seen();
std::uint64_t failed();

void watch();
void unwatch();

/// Allocations seen so far, ever, that have not been freed yet.
std::size_t live();

}  // namespace splat::test::host_memory

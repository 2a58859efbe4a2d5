#pragma once

#include <cstddef>
#include <cstdint>

#include "core/os/file.h"

namespace splat::os {

/// A file's bytes in memory, to read; nullptr with errno if the system cannot.
void* map(Handle file, std::size_t bytes);
void unmap(void* at, std::size_t bytes);
/// Read a mapped file from the disk now, so that a failing disk fails here. -1 if it fails; 0 also where the system
/// does not know how (Linux before 5.14).
int populate_mapped(void* at, std::size_t bytes);

/// Advice on the whole pages within [memory, memory + bytes); a system without it does nothing.
enum class Pages {
    kLarge,     ///< take large ones
    kPopulate,  ///< have the system fill all of them at once
    kDiscard    ///< lose their contents; where the system does it, the next access finds zeros
};
void advise(void* memory, std::size_t bytes, Pages advice);

/// Memory of the machine; 0 if the system does not say.
std::uint64_t machine_bytes();
/// What of it is left, caches that the system gives back included; 0 if the system does not say.
std::uint64_t machine_bytes_left();
/// The innermost cache for code of a core; 0 if the system does not say.
std::uint64_t code_cache_bytes();

}  // namespace splat::os

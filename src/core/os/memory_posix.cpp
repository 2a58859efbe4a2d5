#include "core/os/memory.h"

#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <fstream>
#include <string>

namespace splat::os {
namespace {

[[maybe_unused]] void advise_pages(void* memory, std::size_t bytes, int advice) {
    const long page = ::sysconf(_SC_PAGESIZE);
    if (page <= 0) return;
    const auto size = static_cast<std::uintptr_t>(page);
    const auto at = reinterpret_cast<std::uintptr_t>(memory);
    const std::uintptr_t first = (at + size - 1) / size * size;
    const std::uintptr_t last = (at + bytes) / size * size;
    if (first < last) ::madvise(reinterpret_cast<void*>(first), last - first, advice);
}

}  // namespace

void* map(Handle file, std::size_t bytes) {
    void* const at = ::mmap(nullptr, bytes, PROT_READ, MAP_PRIVATE, file, 0);
    return at == MAP_FAILED ? nullptr : at;
}

void unmap(void* at, std::size_t bytes) {
    ::munmap(at, bytes);
}

int populate_mapped([[maybe_unused]] void* at, [[maybe_unused]] std::size_t bytes) {
#ifdef MADV_POPULATE_READ
    return ::madvise(at, bytes, MADV_POPULATE_READ) == 0 || errno == EINVAL ? 0 : -1;
#else
    return 0;
#endif
}

void advise([[maybe_unused]] void* memory, [[maybe_unused]] std::size_t bytes,
            [[maybe_unused]] Pages advice) {
#ifdef MADV_HUGEPAGE
    if (advice == Pages::kLarge) advise_pages(memory, bytes, MADV_HUGEPAGE);
#endif
#ifdef __linux__
    if (advice == Pages::kDiscard) advise_pages(memory, bytes, MADV_DONTNEED);
#endif
#ifdef MADV_POPULATE_WRITE
    if (advice == Pages::kPopulate) advise_pages(memory, bytes, MADV_POPULATE_WRITE);
#endif
}

std::uint64_t machine_bytes() {
    const long pages = ::sysconf(_SC_PHYS_PAGES);
    const long page = ::sysconf(_SC_PAGESIZE);
    if (pages <= 0 || page <= 0) return 0;
    return static_cast<std::uint64_t>(pages) * static_cast<std::uint64_t>(page);
}

std::uint64_t machine_bytes_left() {
    std::ifstream file("/proc/meminfo");
    for (std::string line; std::getline(file, line);) {
        unsigned long long kilobytes = 0;
        if (std::sscanf(line.c_str(), "MemAvailable: %llu kB", &kilobytes) == 1)
            return kilobytes * 1024;
    }
    return 0;
}

std::uint64_t code_cache_bytes() {
#if defined(_SC_LEVEL1_ICACHE_SIZE)
    const long bytes = ::sysconf(_SC_LEVEL1_ICACHE_SIZE);
    return bytes > 0 ? static_cast<std::uint64_t>(bytes) : 0;
#else
    return 0;
#endif
}

}  // namespace splat::os

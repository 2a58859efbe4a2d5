#include "core/large_vector.h"

#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>

namespace splat {
namespace {

/// madvise() of the whole pages within [memory, memory + bytes).
[[maybe_unused]] void advise(void* memory, std::size_t bytes, int advice) {
    const long page = sysconf(_SC_PAGESIZE);
    if (page <= 0) return;
    const auto size = static_cast<std::uintptr_t>(page);
    const auto at = reinterpret_cast<std::uintptr_t>(memory);
    const std::uintptr_t first = (at + size - 1) / size * size;
    const std::uintptr_t last = (at + bytes) / size * size;
    if (first < last) madvise(reinterpret_cast<void*>(first), last - first, advice);
}

}  // namespace

void advise_large_pages(void* memory, std::size_t bytes) {
#ifdef MADV_HUGEPAGE
    if (bytes >= kLargePageBytes) advise(memory, bytes, MADV_HUGEPAGE);
#else
    (void)memory, (void)bytes;
#endif
}

void populate_pages(void* memory, std::size_t bytes) {
    advise_large_pages(memory, bytes);
#ifdef MADV_POPULATE_WRITE
    advise(memory, bytes, MADV_POPULATE_WRITE);
#endif
}

}  // namespace splat

#include "core/large_vector.h"

#include "core/os/memory.h"

namespace splat {

void advise_large_pages(void* memory, std::size_t bytes) {
    if (bytes >= kLargePageBytes) os::advise(memory, bytes, os::Pages::kLarge);
}

void populate_pages(void* memory, std::size_t bytes) {
    advise_large_pages(memory, bytes);
    os::advise(memory, bytes, os::Pages::kPopulate);
}

void discard_pages(void* memory, std::size_t bytes) {
    os::advise(memory, bytes, os::Pages::kDiscard);
}

}  // namespace splat

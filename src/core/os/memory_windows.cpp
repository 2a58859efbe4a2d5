#include "core/os/memory.h"

#include <vector>

#include "core/os/windows.h"

namespace splat::os {

void* map(Handle file, std::size_t bytes) {
    const HANDLE mapping =
        ::CreateFileMappingW(reinterpret_cast<HANDLE>(file), nullptr, PAGE_READONLY, 0, 0, nullptr);
    if (mapping == nullptr) return fail(), nullptr;
    void* const at = ::MapViewOfFile(mapping, FILE_MAP_READ, 0, 0, bytes);
    if (at == nullptr) fail();
    ::CloseHandle(mapping);  // the view keeps it
    return at;
}

void unmap(void* at, std::size_t) {
    ::UnmapViewOfFile(at);
}

/// A disk that fails is an exception at the first access, as a signal elsewhere.
int populate_mapped(void*, std::size_t) {
    return 0;
}

/// Large pages need a privilege here, and nothing fills pages at once.
void advise(void* memory, std::size_t bytes, Pages advice) {
    if (advice != Pages::kDiscard) return;
    SYSTEM_INFO system{};
    ::GetSystemInfo(&system);
    const std::uintptr_t page = system.dwPageSize;
    const auto at = reinterpret_cast<std::uintptr_t>(memory);
    const std::uintptr_t first = (at + page - 1) / page * page;
    const std::uintptr_t last = (at + bytes) / page * page;
    if (first >= last) return;
    void* const pages = reinterpret_cast<void*>(first);
    // The contents are not kept, and the pages, which are not locked, leave the working set. DiscardVirtualMemory does
    // both at once, but Wine has none.
    ::VirtualAlloc(pages, last - first, MEM_RESET, PAGE_READWRITE);
    ::VirtualUnlock(pages, last - first);
}

std::uint64_t machine_bytes() {
    MEMORYSTATUSEX status{};
    status.dwLength = sizeof status;
    return ::GlobalMemoryStatusEx(&status) != 0 ? status.ullTotalPhys : 0;
}

std::uint64_t machine_bytes_left() {
    MEMORYSTATUSEX status{};
    status.dwLength = sizeof status;
    return ::GlobalMemoryStatusEx(&status) != 0 ? status.ullAvailPhys : 0;
}

std::uint64_t code_cache_bytes() {
    DWORD bytes = 0;
    ::GetLogicalProcessorInformation(nullptr, &bytes);
    std::vector<SYSTEM_LOGICAL_PROCESSOR_INFORMATION> all(
        bytes / sizeof(SYSTEM_LOGICAL_PROCESSOR_INFORMATION));
    if (all.empty() || ::GetLogicalProcessorInformation(all.data(), &bytes) == 0) return 0;
    for (const auto& part : all)
        if (part.Relationship == RelationCache && part.Cache.Level == 1 &&
            part.Cache.Type == CacheInstruction)
            return part.Cache.Size;
    return 0;
}

}  // namespace splat::os

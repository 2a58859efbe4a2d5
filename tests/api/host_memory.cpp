#include "api/host_memory.h"

#include <execinfo.h>
#include <link.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <new>
#include <utility>

namespace splat::test::host_memory {
namespace {

/// Code segments of one loaded object, of which there are few.
struct Text {
    std::array<std::uintptr_t, 16> bounds{};  // begin, end, begin, end, ...
    std::size_t used = 0;

    [[nodiscard]] bool holds(const void* address) const {
        const auto at = reinterpret_cast<std::uintptr_t>(address);
        for (std::size_t i = 0; i < used; i += 2)
            if (at >= bounds[i] && at < bounds[i + 1]) return true;
        return false;
    }
};

Text g_program;
Text g_standard_library;

int read_object(dl_phdr_info* object, std::size_t, void*) {
    const bool program = object->dlpi_name[0] == '\0';
    const bool standard = std::strstr(object->dlpi_name, "libstdc++") != nullptr;
    if (!program && !standard) return 0;
    Text& text = program ? g_program : g_standard_library;
    for (int i = 0; i < object->dlpi_phnum; ++i) {
        const ElfW(Phdr)& segment = object->dlpi_phdr[i];
        if (segment.p_type != PT_LOAD || (segment.p_flags & PF_X) == 0) continue;
        if (text.used + 2 > text.bounds.size()) std::abort();
        text.bounds[text.used++] = object->dlpi_addr + segment.p_vaddr;
        text.bounds[text.used++] = object->dlpi_addr + segment.p_vaddr + segment.p_memsz;
    }
    return 0;
}

/// Hash table of the library's live allocations: open addressing in static memory.
class LiveSet {
  public:
    void add(void* pointer) {
        const std::lock_guard lock(mutex_);
        if (count_ >= kSlots / 2) std::abort();  // no test keeps this much
        std::size_t at = slot(pointer);
        while (slots_[at] != nullptr) at = (at + 1) % kSlots;
        slots_[at] = pointer;
        ++count_;
    }

    void remove(void* pointer) {
        if (count_.load(std::memory_order_relaxed) == 0) return;
        const std::lock_guard lock(mutex_);
        std::size_t at = slot(pointer);
        while (slots_[at] != nullptr && slots_[at] != pointer) at = (at + 1) % kSlots;
        if (slots_[at] == nullptr) return;
        slots_[at] = nullptr;
        --count_;
        // Later entries may be displaced by this one.
        for (std::size_t i = (at + 1) % kSlots; slots_[i] != nullptr; i = (i + 1) % kSlots) {
            void* const moved = std::exchange(slots_[i], nullptr);
            std::size_t to = slot(moved);
            while (slots_[to] != nullptr) to = (to + 1) % kSlots;
            slots_[to] = moved;
        }
    }

    [[nodiscard]] std::size_t count() const { return count_.load(); }

  private:
    static constexpr std::size_t kSlots = std::size_t{1} << 15;
    static std::size_t slot(void* pointer) {
        return (reinterpret_cast<std::uintptr_t>(pointer) >> 4) * 0x9E3779B97F4A7C15ULL >> 49;
    }
    std::mutex mutex_;
    std::atomic<std::size_t> count_{0};
    std::array<void*, kSlots> slots_{};
};

LiveSet g_live;
std::uint64_t g_first = kForever;
std::uint64_t g_count = 0;
std::uint64_t g_seen = 0;  // these four belong to the watching thread
std::uint64_t g_failed = 0;
thread_local bool t_watching = false;

/// True if the library called operator new. `caller` is its return address.
bool from_library(void* caller) {
    if (g_program.holds(caller)) return true;
    if (!g_standard_library.holds(caller)) return false;
    std::array<void*, 64> frames{};
    t_watching = false;  // backtrace may allocate
    const int depth = backtrace(frames.data(), static_cast<int>(frames.size()));
    t_watching = true;
    void* const* const end = frames.data() + depth;
    void* const* at = std::find<void* const*>(frames.data(), end, caller);
    while (at != end && g_standard_library.holds(*at)) ++at;
    return at != end && g_program.holds(*at);
}

bool count_and_decide() {
    ++g_seen;
    const bool fails = g_seen >= g_first && g_seen - g_first < g_count;
    if (fails) ++g_failed;
    return fails;
}

void* allocate(std::size_t bytes, std::size_t alignment, void* caller) noexcept {
    const bool counted = t_watching && from_library(caller);
    if (counted && count_and_decide()) return nullptr;
    const std::size_t size = std::max<std::size_t>(bytes, 1);
    void* const pointer =
        alignment <= alignof(std::max_align_t)
            ? std::malloc(size)
            : std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
    if (counted && pointer != nullptr) g_live.add(pointer);
    return pointer;
}

void* allocate_or_throw(std::size_t bytes, std::size_t alignment, void* caller) {
    void* const pointer = allocate(bytes, alignment, caller);
    if (pointer == nullptr) throw std::bad_alloc();
    return pointer;
}

void release(void* pointer) noexcept {
    if (pointer == nullptr) return;
    g_live.remove(pointer);
    std::free(pointer);
}

}  // namespace

void fail(std::uint64_t first, std::uint64_t count) {
    if (g_program.used == 0) {
        dl_iterate_phdr(read_object, nullptr);
        std::array<void*, 4> frames{};
        backtrace(frames.data(), 4);  // loads the unwinder now
    }
    g_first = first;
    g_count = count;
    g_seen = 0;
    g_failed = 0;
}

void fail_none() {
    fail(kForever, 0);
}

std::uint64_t seen() {
    return g_seen;
}

std::uint64_t failed() {
    return g_failed;
}

void watch() {
    t_watching = true;
}

void unwatch() {
    t_watching = false;
}

std::size_t live() {
    return g_live.count();
}

}  // namespace splat::test::host_memory

namespace memory = splat::test::host_memory;

#define SPLAT_CALLER __builtin_return_address(0)

void* operator new(std::size_t bytes) {
    return memory::allocate_or_throw(bytes, 0, SPLAT_CALLER);
}
void* operator new[](std::size_t bytes) {
    return memory::allocate_or_throw(bytes, 0, SPLAT_CALLER);
}
void* operator new(std::size_t bytes, std::align_val_t alignment) {
    return memory::allocate_or_throw(bytes, static_cast<std::size_t>(alignment), SPLAT_CALLER);
}
void* operator new[](std::size_t bytes, std::align_val_t alignment) {
    return memory::allocate_or_throw(bytes, static_cast<std::size_t>(alignment), SPLAT_CALLER);
}
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept {
    return memory::allocate(bytes, 0, SPLAT_CALLER);
}
void* operator new[](std::size_t bytes, const std::nothrow_t&) noexcept {
    return memory::allocate(bytes, 0, SPLAT_CALLER);
}
void* operator new(std::size_t bytes, std::align_val_t alignment, const std::nothrow_t&) noexcept {
    return memory::allocate(bytes, static_cast<std::size_t>(alignment), SPLAT_CALLER);
}
void* operator new[](std::size_t bytes, std::align_val_t alignment,
                     const std::nothrow_t&) noexcept {
    return memory::allocate(bytes, static_cast<std::size_t>(alignment), SPLAT_CALLER);
}

void operator delete(void* pointer) noexcept {
    memory::release(pointer);
}
void operator delete[](void* pointer) noexcept {
    memory::release(pointer);
}
void operator delete(void* pointer, std::size_t) noexcept {
    memory::release(pointer);
}
void operator delete[](void* pointer, std::size_t) noexcept {
    memory::release(pointer);
}
void operator delete(void* pointer, std::align_val_t) noexcept {
    memory::release(pointer);
}
void operator delete[](void* pointer, std::align_val_t) noexcept {
    memory::release(pointer);
}
void operator delete(void* pointer, std::size_t, std::align_val_t) noexcept {
    memory::release(pointer);
}
void operator delete[](void* pointer, std::size_t, std::align_val_t) noexcept {
    memory::release(pointer);
}
void operator delete(void* pointer, const std::nothrow_t&) noexcept {
    memory::release(pointer);
}
void operator delete[](void* pointer, const std::nothrow_t&) noexcept {
    memory::release(pointer);
}
void operator delete(void* pointer, std::align_val_t, const std::nothrow_t&) noexcept {
    memory::release(pointer);
}
void operator delete[](void* pointer, std::align_val_t, const std::nothrow_t&) noexcept {
    memory::release(pointer);
}

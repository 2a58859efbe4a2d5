#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "vk/buffer.h"
#include "vk/external_memory.h"

namespace splat::vk {

enum class MemoryKind : int {
    kDevice = 0,   ///< fastest for shaders; mapped only on unified memory
    kStaging = 1,  ///< host-visible, cached if possible; for transfers
    kExternal =
        2,  ///< device memory of one buffer, which other APIs and processes open; see external_memory.h
};

/// One VkDeviceMemory and the VkBuffer that covers it.
struct Block {
    MemoryKind kind = MemoryKind::kDevice;
    VkDeviceMemory memory = VK_NULL_HANDLE;
    VkBuffer buffer = VK_NULL_HANDLE;
    std::uint64_t bytes = 0;
    std::byte* host = nullptr;  ///< whole block mapped, or nullptr
    bool coherent = true;
    std::uint64_t memory_bytes = 0;  ///< allocated size, where it can be exported; else 0
    std::uint32_t memory_type = 0;   ///< index of the memory type

    struct Range {
        std::uint64_t bytes;    ///< guards and padding included
        std::uint64_t payload;  ///< bytes of the buffer; 0 when free
        bool deferred = false;  ///< freed, but the device may still be using it
    };
    std::map<std::uint64_t, Range> free;  ///< by offset, coalesced
    std::map<std::uint64_t, Range> live;  ///< by offset
};

struct MemoryDesc {
    std::uint64_t budget_bytes =
        0;  ///< 0 = heap; on CPU devices 3/4 of physical memory (their heap size is fictional)
    std::uint64_t block_bytes = std::uint64_t{32} << 20;
    bool guard = false;  ///< 64 guard bytes on both sides of every mapped allocation
    bool hide_host =
        false;  ///< tests: pretend that device memory is not host-visible and nothing is coherent
    std::optional<std::uint32_t> poison;  ///< tests: word that fills every fresh allocation
};

/// Device memory. The staging buffer of transfers, at most 8 MiB of the host's, does not count.
struct MemoryUse {
    std::uint32_t allocations = 0;  ///< live VkDeviceMemory objects
    std::uint64_t used = 0;         ///< bytes allocated from the driver
    std::uint64_t live = 0;         ///< bytes of living buffers
    std::uint64_t peak = 0;         ///< highest `used`
    std::uint64_t budget = 0;
};

/// Sub-allocates buffers from blocks of driver memory, within a budget that it enforces itself.
///
/// First fit in offset order; an empty block goes back to the driver. Not thread-safe except use(): the
/// Context's mutex guards it.
class Memory : NoCopy {
  public:
    Memory(Device& device, const MemoryDesc& desc);
    ~Memory();

    /// `bytes` > 0, rounded up to whole quads. Contents are undefined. Errors: kUnsupported beyond
    /// maxMemoryAllocationSize, kOutOfDeviceMemory beyond the budget or the driver's memory;
    /// `name` appears in the message.
    Result<Buffer> allocate(std::uint64_t bytes, MemoryKind kind, std::string_view name);

    /// A handle of the memory of a buffer of kExternal, which the caller closes. It keeps the memory alive, whatever
    /// becomes of the buffer. Errors: kInvalidState for other memory; the driver's.
    Result<ExternalMemory> export_memory(const BufferView& view);

    /// A buffer of `bytes` in memory that another process or API exported. The handle stays the caller's. Errors:
    /// kInvalidArgument (no handle of memory of this device and driver, too little memory, offset), kUnsupported, and
    /// those of allocate().
    Result<Buffer> import_memory(const ExternalMemory& from, std::uint64_t bytes,
                                 std::string_view name);

    /// Thread-safe; waits for no other call.
    [[nodiscard]] MemoryUse use() const;

    /// Host address of a view, or nullptr if its memory is not mapped.
    static std::byte* host(const BufferView& view);

    /// True if the host and the device see one another's writes there without flush() and
    /// invalidate().
    static bool coherent(const BufferView& view) { return view.block->coherent; }

    /// Make host writes visible to the device, or device writes to the host, where memory is not
    /// coherent.
    Status flush(const BufferView& view);
    Status invalidate(const BufferView& view);

    /// Keep `used` at or below so many bytes, if the budget is more. Returns the limit before.
    std::uint64_t set_limit(std::uint64_t bytes) { return std::exchange(limit_, bytes); }

    /// Why the device may still use freed ranges: by work that runs, or by work that is noted.
    enum class Deferral : unsigned { kRunning = 1, kNoted = 2 };
    /// While there is a reason, freed ranges are not reused.
    void defer_frees(Deferral why, bool defer) noexcept;

    /// kInternal, naming the offset, if a guard word of a living buffer, or of one freed since the
    /// last call, was overwritten. Always ok without guards.
    Status check_guards();

  private:
    friend class Buffer;
    void release(const BufferView& view) noexcept;
    void give_back(Block& block, std::uint64_t offset) noexcept;
    void drop_if_empty(Block& block) noexcept;
    /// `from`: import its memory; else nullptr.
    Result<Block*> add_block(std::uint64_t bytes, MemoryKind kind, std::string_view name,
                             const ExternalMemory* from);
    void count_live(const Block& block, std::uint64_t offset);
    [[nodiscard]] std::uint64_t guard(MemoryKind kind) const {
        return kind == MemoryKind::kExternal ? 0 : guard_bytes_;  // others know no guards
    }
    std::optional<std::uint64_t> take(Block& block, std::uint64_t bytes, std::uint64_t payload);
    [[nodiscard]] std::vector<std::uint32_t> memory_types(std::uint32_t allowed,
                                                          MemoryKind kind) const;
    Result<VkMemoryPropertyFlags> allocate_memory(Block& block, const ExternalMemory* from) const;
    Status make_block(Block& block, std::uint64_t bytes, const ExternalMemory* from);
    void destroy(Block& block) noexcept;
    [[nodiscard]] VkMappedMemoryRange mapped_range(const BufferView& view) const;
    void prepare(const Block& block, std::uint64_t offset) const;
    [[nodiscard]] std::optional<std::uint64_t> broken_guard(const Block& block,
                                                            std::uint64_t offset) const;

    Device& device_;
    MemoryDesc desc_;
    std::uint64_t alignment_;
    std::uint64_t guard_bytes_;
    mutable std::mutex use_mutex_;  ///< guards use_, held while numbers change
    MemoryUse use_;
    std::uint64_t limit_ = ~std::uint64_t{0};
    std::vector<std::unique_ptr<Block>> blocks_;
    unsigned defer_ = 0;                   ///< Deferral, as bits
    std::size_t deferred_ = 0;             ///< ranges freed but not yet reusable
    std::optional<std::uint64_t> broken_;  ///< offset of a broken guard of a freed buffer
};

/// A limit of the memory while it lives. For the holder of the Context's mutex.
class MemoryLimit : NoCopy {
  public:
    MemoryLimit(Memory& memory, std::uint64_t bytes)
        : memory_(memory), before_(memory.set_limit(bytes)) {}
    ~MemoryLimit() { memory_.set_limit(before_); }

  private:
    Memory& memory_;
    std::uint64_t before_;
};

}  // namespace splat::vk

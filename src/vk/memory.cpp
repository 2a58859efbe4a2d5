#include "vk/memory.h"

#include <algorithm>
#include <cstring>

#include "core/checked_math.h"
#include "core/fault.h"
#include "core/large_vector.h"
#include "core/os/memory.h"

namespace splat::vk {
namespace {

constexpr std::uint32_t kGuardWord = 0x5AFE5AFEU;
constexpr std::uint64_t kGuardBytes = 64;

std::uint64_t default_budget(const DeviceInfo& info) {
    if (info.kind != DeviceKind::kCpu) return info.limits.heap_bytes;
    const std::uint64_t bytes = os::machine_bytes();
    return bytes == 0 ? info.limits.heap_bytes : bytes / 4 * 3;
}

void fill_words(std::byte* at, std::uint64_t bytes, std::uint32_t word) {
    for (std::uint64_t i = 0; i + 4 <= bytes; i += 4) std::memcpy(at + i, &word, 4);
}

}  // namespace

Buffer::~Buffer() {
    if (memory_ != nullptr) memory_->release(range_);
}

BufferView Buffer::view(const Shape& shape) const {
    BufferView view = range_;
    view.shape = shape;
    view.bytes = quad_bytes(shape.elements());
    SPLAT_ASSERT(view.bytes <= range_.bytes);
    return view;
}

Memory::Memory(Device& device, const MemoryDesc& desc)
    : device_(device),
      desc_(desc),
      // 64 also gives every allocation its own cache line.
      alignment_(std::max<std::uint64_t>(device.info().limits.offset_alignment, 64)),
      guard_bytes_(desc.guard ? round_up(kGuardBytes, alignment_) : 0) {
    use_.budget = desc.budget_bytes != 0 ? desc.budget_bytes : default_budget(device.info());
}

Memory::~Memory() {
    for (const auto& block : blocks_) destroy(*block);
}

MemoryUse Memory::use() const {
    const std::lock_guard lock(use_mutex_);
    return use_;
}

/// Types to try, best first. Discrete devices compute too slowly in the host's memory: theirs are local.
std::vector<std::uint32_t> Memory::memory_types(std::uint32_t allowed, MemoryKind kind) const {
    constexpr VkMemoryPropertyFlags kVisible = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT;
    constexpr VkMemoryPropertyFlags kRead = kVisible | VK_MEMORY_PROPERTY_HOST_CACHED_BIT;
    constexpr VkMemoryPropertyFlags kLocal = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT;
    // These need a feature, or hold no buffers.
    constexpr VkMemoryPropertyFlags kOdd =
        VK_MEMORY_PROPERTY_PROTECTED_BIT | VK_MEMORY_PROPERTY_LAZILY_ALLOCATED_BIT |
        VK_MEMORY_PROPERTY_DEVICE_COHERENT_BIT_AMD | VK_MEMORY_PROPERTY_DEVICE_UNCACHED_BIT_AMD;
    const DeviceInfo& info = device_.info();
    std::vector<VkMemoryPropertyFlags> wishes{kRead, kVisible};
    if (kind != MemoryKind::kStaging) {
        wishes = {kLocal};
        if (info.features.unified_memory) wishes = {kLocal | kRead, kLocal | kVisible, kLocal};
        if (info.kind != DeviceKind::kDiscrete) wishes.push_back(0);
    }
    const VkPhysicalDeviceMemoryProperties& memory = device_.memory_properties();
    std::vector<std::uint32_t> types;
    for (const VkMemoryPropertyFlags wish : wishes)
        for (std::uint32_t i = 0; i < memory.memoryTypeCount; ++i)
            if ((allowed >> i & 1U) != 0 &&
                (memory.memoryTypes[i].propertyFlags & (wish | kOdd)) == wish &&
                std::ranges::find(types, i) == types.end())
                types.push_back(i);
    return types;
}

/// Give a buffer its memory, of the next type where one has no room left. Returns what the type has.
Result<VkMemoryPropertyFlags> Memory::allocate_memory(Block& block,
                                                      const ExternalMemory* from) const {
    VkMemoryRequirements needs{};
    device_.vk.vkGetBufferMemoryRequirements(device_.handle(), block.buffer, &needs);
    std::vector<std::uint32_t> types = memory_types(needs.memoryTypeBits, block.kind);
    if (from != nullptr) SPLAT_TRY(check_import(*from, needs, types));
    if (types.empty())
        return unsupported(
            "the device has no memory type for storage buffers that the host can see");
    const VkPhysicalDeviceMemoryProperties& memory = device_.memory_properties();
    const bool fault = SPLAT_FAULT("vk.allocate_memory");
    VkResult result = VK_ERROR_OUT_OF_DEVICE_MEMORY;
    for (const std::uint32_t type : types) {
        const VkMemoryType& found = memory.memoryTypes[type];
        if (type != types[0] && memory.memoryHeaps[found.heapIndex].size < needs.size) continue;
        VkMemoryAllocateInfo allocate{.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO,
                                      .pNext = nullptr,
                                      .allocationSize = needs.size,
                                      .memoryTypeIndex = type};
        if (!fault && block.kind == MemoryKind::kExternal)
            result = allocate_external(device_, allocate, from, block.memory);
        else if (!fault)
            result =
                device_.vk.vkAllocateMemory(device_.handle(), &allocate, nullptr, &block.memory);
        if (result != VK_ERROR_OUT_OF_DEVICE_MEMORY) {
            SPLAT_TRY(device_.check(result, "vkAllocateMemory"));
            if (from == nullptr && block.kind == MemoryKind::kExternal)
                block.memory_bytes = needs.size;
            block.memory_type = type;
            return found.propertyFlags;
        }
    }
    return device_.check(result, "vkAllocateMemory");
}

Status Memory::make_block(Block& block, std::uint64_t bytes, const ExternalMemory* from) {
    const bool external = block.kind == MemoryKind::kExternal;
    VkBufferCreateInfo info{.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO,
                            .pNext = external ? &kExternalBuffer : nullptr,
                            .size = bytes,
                            .usage = kBufferUsage};
    SPLAT_TRY(device_.check(
        SPLAT_FAULT("vk.create_buffer")
            ? VK_ERROR_OUT_OF_DEVICE_MEMORY
            : device_.vk.vkCreateBuffer(device_.handle(), &info, nullptr, &block.buffer),
        "vkCreateBuffer"));
    SPLAT_ASSIGN(const VkMemoryPropertyFlags flags, allocate_memory(block, from));
    SPLAT_TRY(device_.check(
        device_.vk.vkBindBufferMemory(device_.handle(), block.buffer, block.memory, 0),
        "vkBindBufferMemory"));
    constexpr VkMemoryPropertyFlags kRead =
        VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_CACHED_BIT;
    const bool map =
        block.kind == MemoryKind::kStaging ||
        ((flags & kRead) == kRead && device_.info().features.unified_memory && !desc_.hide_host);
    if (map) {
        void* host = nullptr;
        SPLAT_TRY(device_.check(SPLAT_FAULT("vk.map_memory")
                                    ? VK_ERROR_MEMORY_MAP_FAILED
                                    : device_.vk.vkMapMemory(device_.handle(), block.memory, 0,
                                                             VK_WHOLE_SIZE, 0, &host),
                                "vkMapMemory"));
        block.host = static_cast<std::byte*>(host);
        if (device_.info().kind == DeviceKind::kCpu) advise_large_pages(block.host, bytes);
    }
    block.coherent = (flags & VK_MEMORY_PROPERTY_HOST_COHERENT_BIT) != 0 && !desc_.hide_host;
    block.bytes = bytes;
    return {};
}

Result<Block*> Memory::add_block(std::uint64_t bytes, MemoryKind kind, std::string_view name,
                                 const ExternalMemory* from) {
    const std::uint64_t limit = device_.info().limits.max_allocation_bytes;
    if (bytes > limit)
        return unsupported("%.*s: %llu bytes, but device %u (%s) allocates at most %llu at once",
                           static_cast<int>(name.size()), name.data(), llu(bytes),
                           device_.info().index, device_.info().name.c_str(), llu(limit));
    const bool counts = kind != MemoryKind::kStaging;
    const std::uint64_t budget = std::min(use_.budget, limit_);
    if (counts && (use_.used > budget || bytes > budget - use_.used))
        return error(Code::kOutOfDeviceMemory,
                     "%.*s: needs %llu bytes more, but %llu of the %s of %llu are in use; free "
                     "tensors or raise %s",
                     static_cast<int>(name.size()), name.data(), llu(bytes), llu(use_.used),
                     limit_ < use_.budget ? "bound" : "budget", llu(budget),
                     limit_ < use_.budget ? "the memory of the fit" : "max_device_bytes");
    // Whole blocks while they fit in the budget, so that small tensors share one. Larger ones would waste the rest.
    std::uint64_t size = bytes;
    if (bytes <= desc_.block_bytes / 4) size = std::min(desc_.block_bytes, limit);
    if (kind != MemoryKind::kDevice) size = bytes;  // staging buffers are few
    if (counts && size > budget - use_.used) size = bytes;

    blocks_.reserve(blocks_.size() + 1);
    auto block = std::make_unique<Block>();
    block->kind = kind;
    block->free.emplace(0, Block::Range{size, 0});
    Status status = make_block(*block, size, from);
    if (!status.ok()) {
        destroy(*block);
        return status;
    }
    if (counts) {
        const std::lock_guard lock(use_mutex_);
        use_.used += size;
        use_.peak = std::max(use_.peak, use_.used);
        ++use_.allocations;
    }
    blocks_.push_back(std::move(block));
    return blocks_.back().get();
}

std::optional<std::uint64_t> Memory::take(Block& block, std::uint64_t bytes,
                                          std::uint64_t payload) {
    for (auto hole = block.free.begin(); hole != block.free.end(); ++hole) {
        if (hole->second.bytes < bytes) continue;
        const std::uint64_t offset = hole->first;
        const std::uint64_t rest = hole->second.bytes - bytes;
        // The only step that can throw comes first.
        block.live.emplace(offset, Block::Range{bytes, payload});
        auto node = block.free.extract(hole);
        if (rest > 0) {
            node.key() = offset + bytes;
            node.mapped().bytes = rest;
            block.free.insert(std::move(node));
        }
        return offset;
    }
    return std::nullopt;
}

void Memory::count_live(const Block& block, std::uint64_t offset) {
    if (block.kind == MemoryKind::kStaging) return;
    const std::lock_guard lock(use_mutex_);
    use_.live += block.live.at(offset).bytes;
}

void Memory::prepare(const Block& block, std::uint64_t offset) const {
    if (block.host == nullptr || block.kind == MemoryKind::kExternal) return;
    const Block::Range& range = block.live.at(offset);
    if (desc_.poison) fill_words(block.host + offset, range.bytes, *desc_.poison);
    if (guard_bytes_ == 0) return;
    const std::uint64_t behind = offset + guard_bytes_ + range.payload;
    fill_words(block.host + offset, guard_bytes_, kGuardWord);
    fill_words(block.host + behind, offset + range.bytes - behind, kGuardWord);
}

std::optional<std::uint64_t> Memory::broken_guard(const Block& block, std::uint64_t offset) const {
    if (block.host == nullptr || guard(block.kind) == 0) return std::nullopt;
    const Block::Range& range = block.live.at(offset);
    const std::uint64_t start = offset + guard_bytes_;
    for (std::uint64_t at = offset; at < offset + range.bytes; at += 4) {
        if (at == start) at += range.payload;
        std::uint32_t word = 0;
        std::memcpy(&word, block.host + at, 4);
        if (word != kGuardWord) return at;
    }
    return std::nullopt;
}

Result<Buffer> Memory::allocate(std::uint64_t bytes, MemoryKind kind, std::string_view name) {
    SPLAT_ASSERT(bytes > 0);
    SPLAT_TRY(device_.alive());
    const std::uint64_t payload = round_up(bytes, 16);
    const std::uint64_t total = round_up(payload + 2 * guard(kind), alignment_);
    if (kind == MemoryKind::kExternal) SPLAT_TRY(check_external(device_));
    Block* block = nullptr;
    std::optional<std::uint64_t> offset;
    for (const auto& candidate : blocks_) {
        if (candidate->kind != kind || kind == MemoryKind::kExternal) continue;
        offset = take(*candidate, total, payload);
        block = candidate.get();
        if (offset) break;
    }
    if (!offset) {
        SPLAT_ASSIGN(block, add_block(total, kind, name, nullptr));
        offset = take(*block, total, payload);
    }
    count_live(*block, *offset);
    prepare(*block, *offset);
    BufferView range{
        .block = block, .buffer = block->buffer, .offset = *offset + guard(kind), .bytes = payload};
    return Buffer(this, range);
}

void Memory::release(const BufferView& view) noexcept {
    Block& block = *view.block;
    // Imported memory has its bytes anywhere in the only range.
    const std::uint64_t offset =
        block.kind == MemoryKind::kExternal ? 0 : view.offset - guard_bytes_;
    if (const auto broken = broken_guard(block, offset)) broken_ = broken;
    Block::Range& range = block.live.find(offset)->second;
    if (block.kind != MemoryKind::kStaging) {
        const std::lock_guard lock(use_mutex_);
        use_.live -= range.bytes;
    }
    if (defer_ != 0) {
        range.deferred = true;
        ++deferred_;
        return;
    }
    give_back(block, offset);
    drop_if_empty(block);
}

/// Reuses the map's node, which keeps this free of allocation, hence noexcept.
void Memory::give_back(Block& block, std::uint64_t offset) noexcept {
    auto node = block.live.extract(offset);
    node.mapped().payload = 0;
    node.mapped().deferred = false;
    auto next = block.free.insert(std::move(node)).position;
    const auto after = std::next(next);
    if (after != block.free.end() && offset + next->second.bytes == after->first) {
        next->second.bytes += after->second.bytes;
        block.free.erase(after);
    }
    if (next != block.free.begin()) {
        const auto before = std::prev(next);
        if (before->first + before->second.bytes == offset) {
            before->second.bytes += next->second.bytes;
            block.free.erase(next);
        }
    }
}

void Memory::drop_if_empty(Block& block) noexcept {
    if (!block.live.empty()) return;
    const auto at = std::ranges::find_if(blocks_, [&](const auto& b) { return b.get() == &block; });
    if (block.kind != MemoryKind::kStaging) {
        const std::lock_guard lock(use_mutex_);
        use_.used -= block.bytes;
        --use_.allocations;
    }
    destroy(block);
    blocks_.erase(at);
}

void Memory::defer_frees(Deferral why, bool defer) noexcept {
    const auto bit = static_cast<unsigned>(why);
    defer_ = defer ? defer_ | bit : defer_ & ~bit;
    if (defer_ != 0 || deferred_ == 0) return;
    for (std::size_t i = blocks_.size(); i-- > 0;) {
        Block& block = *blocks_[i];
        for (auto at = block.live.begin(); at != block.live.end();) {
            const auto [offset, range] = *at++;
            if (range.deferred) give_back(block, offset);
        }
        drop_if_empty(block);
    }
    deferred_ = 0;
}

void Memory::destroy(Block& block) noexcept {
    if (block.buffer != VK_NULL_HANDLE)
        device_.vk.vkDestroyBuffer(device_.handle(), block.buffer, nullptr);
    if (block.memory != VK_NULL_HANDLE)
        device_.vk.vkFreeMemory(device_.handle(), block.memory, nullptr);
    block.buffer = VK_NULL_HANDLE;
    block.memory = VK_NULL_HANDLE;
}

std::byte* Memory::host(const BufferView& view) {
    return view.block->host == nullptr ? nullptr : view.block->host + view.offset;
}

VkMappedMemoryRange Memory::mapped_range(const BufferView& view) const {
    VkMappedMemoryRange range{.sType = VK_STRUCTURE_TYPE_MAPPED_MEMORY_RANGE,
                              .memory = view.block->memory,
                              .offset = view.offset / alignment_ * alignment_};
    const std::uint64_t end = round_up(view.end(), alignment_);
    range.size = end >= view.block->bytes ? VK_WHOLE_SIZE : end - range.offset;
    return range;
}

Status Memory::flush(const BufferView& view) {
    if (view.block->coherent) return {};
    const VkMappedMemoryRange range = mapped_range(view);
    return device_.check(device_.vk.vkFlushMappedMemoryRanges(device_.handle(), 1, &range),
                         "vkFlushMappedMemoryRanges");
}

Status Memory::invalidate(const BufferView& view) {
    if (view.block->coherent) return {};
    const VkMappedMemoryRange range = mapped_range(view);
    return device_.check(device_.vk.vkInvalidateMappedMemoryRanges(device_.handle(), 1, &range),
                         "vkInvalidateMappedMemoryRanges");
}

Status Memory::check_guards() {
    std::optional<std::uint64_t> broken = std::exchange(broken_, std::nullopt);
    for (const auto& block : blocks_)
        for (const auto& [offset, range] : block->live)
            if (const auto at = broken_guard(*block, offset)) broken = at;
    if (!broken) return {};
    return error(Code::kInternal, "the guard word at byte %llu of a block was overwritten",
                 llu(*broken));
}

}  // namespace splat::vk

#include "vk/external_memory.h"

#include <algorithm>

#include "core/checked_math.h"
#include "core/os/file.h"
#include "vk/device_choice.h"
#include "vk/memory.h"

namespace splat::vk {
namespace {

using Uuid = std::array<std::uint8_t, VK_UUID_SIZE>;

Status check_uuid(const char* what, const Uuid& theirs, const Uuid& ours) {
    if (theirs == Uuid{} || theirs == ours) return {};
    return invalid(
        "the memory is of another %s: that has the UUID %s, this one has %s: open the device that "
        "has the memory, or copy the elements",
        what, uuid_text(theirs).c_str(), uuid_text(ours).c_str());
}

#if defined(VK_USE_PLATFORM_WIN32_KHR)

VkResult handle_of(Device& device, VkDeviceMemory memory, std::int64_t& handle) {
    const VkMemoryGetWin32HandleInfoKHR info{
        .sType = VK_STRUCTURE_TYPE_MEMORY_GET_WIN32_HANDLE_INFO_KHR,
        .memory = memory,
        .handleType = kExternalHandle};
    HANDLE found = nullptr;
    const VkResult result = device.vk.vkGetMemoryWin32HandleKHR(device.handle(), &info, &found);
    handle = reinterpret_cast<std::intptr_t>(found);
    return result;
}

VkResult import_handle(Device& device, VkMemoryAllocateInfo& info, std::int64_t handle,
                       VkDeviceMemory& memory) {
    const VkImportMemoryWin32HandleInfoKHR import{
        .sType = VK_STRUCTURE_TYPE_IMPORT_MEMORY_WIN32_HANDLE_INFO_KHR,
        .handleType = kExternalHandle,
        .handle = reinterpret_cast<HANDLE>(static_cast<std::intptr_t>(handle))};
    info.pNext = &import;
    return device.vk.vkAllocateMemory(device.handle(), &info, nullptr, &memory);
}

Status check_handle(const ExternalMemory&) {
    return {};
}

#else

VkResult handle_of(Device& device, VkDeviceMemory memory, std::int64_t& handle) {
    const VkMemoryGetFdInfoKHR info{.sType = VK_STRUCTURE_TYPE_MEMORY_GET_FD_INFO_KHR,
                                    .memory = memory,
                                    .handleType = kExternalHandle};
    int fd = -1;
    const VkResult result = device.vk.vkGetMemoryFdKHR(device.handle(), &info, &fd);
    handle = fd;
    return result;
}

/// The driver takes a descriptor if it succeeds, so it gets another.
VkResult import_handle(Device& device, VkMemoryAllocateInfo& info, std::int64_t handle,
                       VkDeviceMemory& memory) {
    const VkImportMemoryFdInfoKHR import{.sType = VK_STRUCTURE_TYPE_IMPORT_MEMORY_FD_INFO_KHR,
                                         .handleType = kExternalHandle,
                                         .fd = os::duplicate(static_cast<int>(handle))};
    if (import.fd < 0) return VK_ERROR_TOO_MANY_OBJECTS;
    info.pNext = &import;
    const VkResult result = device.vk.vkAllocateMemory(device.handle(), &info, nullptr, &memory);
    if (result != VK_SUCCESS) os::close(import.fd);
    return result;
}

/// Drivers need not notice memory that is smaller than they are told, and lavapipe reads from any file, also from a
/// pipe without an end.
Status check_handle(const ExternalMemory& from) {
    os::FileInfo file;
    if (from.handle < 0 || from.handle > INT32_MAX ||
        os::examine(static_cast<int>(from.handle), file) != 0)
        return invalid("the handle of the memory is %lld, which is no open file descriptor",
                       static_cast<long long>(from.handle));
    if (file.kind == os::FileKind::kPipe || file.kind == os::FileKind::kFolder)
        return invalid("the handle of the memory is %lld, which is a pipe, a socket or a folder",
                       static_cast<long long>(from.handle));
    if (file.bytes == 0 || file.bytes >= from.memory_bytes)
        return {};  // some drivers' files have no size
    return invalid("the memory is said to have %llu bytes, but its handle has %llu",
                   llu(from.memory_bytes), llu(file.bytes));
}

#endif

}  // namespace

bool has_external_memory(const Instance& instance, VkPhysicalDevice physical) {
    if (!instance.has_extension(physical, kExternalMemoryExtension)) return false;
    const VkPhysicalDeviceExternalBufferInfo info{
        .sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_EXTERNAL_BUFFER_INFO,
        .usage = kBufferUsage,
        .handleType = kExternalHandle};
    VkExternalBufferProperties found{.sType = VK_STRUCTURE_TYPE_EXTERNAL_BUFFER_PROPERTIES};
    instance.get_external_buffer(physical, &info, &found);
    constexpr VkExternalMemoryFeatureFlags kBoth =
        VK_EXTERNAL_MEMORY_FEATURE_EXPORTABLE_BIT | VK_EXTERNAL_MEMORY_FEATURE_IMPORTABLE_BIT;
    return (found.externalMemoryProperties.externalMemoryFeatures &
            (kBoth | VK_EXTERNAL_MEMORY_FEATURE_DEDICATED_ONLY_BIT)) == kBoth;
}

Status check_external(const Device& device) {
    const DeviceInfo& info = device.info();
    if (info.features.external_memory) return {};
    return unsupported(
        "device %u (%s) shares no memory of buffers with other processes and APIs (%s): copy the "
        "elements by way of host memory",
        info.index, info.name.c_str(), kExternalMemoryExtension);
}

Status check_import(const ExternalMemory& from, const VkMemoryRequirements& needs,
                    std::vector<std::uint32_t>& types) {
    if (from.memory_bytes < needs.size)
        return invalid(
            "the memory has %llu bytes, but the elements need %llu: whole quads of 16 bytes, "
            "from byte %llu on",
            llu(from.memory_bytes), llu(needs.size), llu(from.offset));
    if (from.memory_type == 0) return {};
    const std::uint32_t index = from.memory_type - 1;
    if (index >= VK_MAX_MEMORY_TYPES || (needs.memoryTypeBits >> index & 1U) == 0)
        return invalid("the memory has the type %u, in which the device keeps no buffers", index);
    types = {index};
    return {};
}

VkResult allocate_external(Device& device, VkMemoryAllocateInfo& info, const ExternalMemory* from,
                           VkDeviceMemory& memory) {
    if (from != nullptr) {
        info.allocationSize = from->memory_bytes;
        return import_handle(device, info, from->handle, memory);
    }
    const VkExportMemoryAllocateInfo exported{
        .sType = VK_STRUCTURE_TYPE_EXPORT_MEMORY_ALLOCATE_INFO, .handleTypes = kExternalHandle};
    info.pNext = &exported;
    return device.vk.vkAllocateMemory(device.handle(), &info, nullptr, &memory);
}

Result<ExternalMemory> Memory::export_memory(const BufferView& view) {
    SPLAT_TRY(device_.alive());
    const Block& block = *view.block;
    if (block.memory_bytes == 0)
        return bad_state("the memory was not made to be exported, or was imported itself");
    ExternalMemory memory{.memory_bytes = block.memory_bytes,
                          .offset = view.offset,
                          .memory_type = block.memory_type + 1,
                          .device_uuid = device_.info().uuid,
                          .driver_uuid = device_.info().driver_uuid};
    SPLAT_TRY(device_.check(handle_of(device_, block.memory, memory.handle), "vkGetMemoryFdKHR"));
    return memory;
}

Result<Buffer> Memory::import_memory(const ExternalMemory& from, std::uint64_t bytes,
                                     std::string_view name) {
    SPLAT_ASSERT(bytes > 0);
    SPLAT_TRY(device_.alive());
    SPLAT_TRY(check_external(device_));
    SPLAT_TRY(check_uuid("device", from.device_uuid, device_.info().uuid));
    SPLAT_TRY(check_uuid("driver", from.driver_uuid, device_.info().driver_uuid));
    if (from.offset % device_.info().limits.offset_alignment != 0)
        return invalid("the elements begin at byte %llu of the memory, expected a multiple of %llu",
                       llu(from.offset), llu(device_.info().limits.offset_alignment));
    const std::uint64_t payload = round_up(bytes, 16);
    if (from.memory_bytes < payload || from.offset > from.memory_bytes - payload)
        return invalid(
            "the memory has %llu bytes, but the elements need %llu, whole quads of 16 bytes, from "
            "byte %llu on",
            llu(from.memory_bytes), llu(payload), llu(from.offset));
    SPLAT_TRY(check_handle(from));
    SPLAT_ASSIGN(Block* const block,
                 add_block(from.offset + payload, MemoryKind::kExternal, name, &from));
    const auto whole = take(*block, from.offset + payload, payload);
    count_live(*block, *whole);
    return Buffer(
        this, {.block = block, .buffer = block->buffer, .offset = from.offset, .bytes = payload});
}

}  // namespace splat::vk

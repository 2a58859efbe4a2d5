#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/status.h"
#include "vk/device.h"

namespace splat::vk {

/// Memory that a process or another API exported: an opaque handle of its device's driver, which is a file descriptor,
/// on Windows an NT handle. Buffers of it are the system's as soon as they exist: the memory lives until nobody has it
/// open and all handles are closed.
///
/// Order is the host's: work of others ends before a call of the library begins, which has ended on the device when it
/// returns. Drivers keep no state of buffers by family of queues, so that none is handed over.
struct ExternalMemory {
    std::int64_t handle = -1;
    std::uint64_t memory_bytes = 0;  ///< the whole allocation, which the driver needs to know
    std::uint64_t offset = 0;        ///< bytes from its start
    std::uint32_t memory_type = 0;   ///< 1 + its index; 0: not known
    std::array<std::uint8_t, VK_UUID_SIZE> device_uuid{};  ///< zeros: not known
    std::array<std::uint8_t, VK_UUID_SIZE> driver_uuid{};  ///< zeros: not known
};

/// What every buffer of the library may be used for.
inline constexpr VkBufferUsageFlags kBufferUsage =
    VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT |
    VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;

#if defined(VK_USE_PLATFORM_WIN32_KHR)  // by the specification; never run
inline constexpr const char* kExternalMemoryExtension = VK_KHR_EXTERNAL_MEMORY_WIN32_EXTENSION_NAME;
inline constexpr VkExternalMemoryHandleTypeFlagBits kExternalHandle =
    VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_WIN32_BIT;
#else
inline constexpr const char* kExternalMemoryExtension = VK_KHR_EXTERNAL_MEMORY_FD_EXTENSION_NAME;
inline constexpr VkExternalMemoryHandleTypeFlagBits kExternalHandle =
    VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD_BIT;
#endif

/// What the creation of a buffer in such memory is told.
inline constexpr VkExternalMemoryBufferCreateInfo kExternalBuffer{
    VK_STRUCTURE_TYPE_EXTERNAL_MEMORY_BUFFER_CREATE_INFO, nullptr, kExternalHandle};

/// True if the device exports and imports memory of buffers, and not only an image's or buffer's own.
bool has_external_memory(const Instance& instance, VkPhysicalDevice physical);

/// kUnsupported where the device does not: the sentence says to copy.
Status check_external(const Device& device);

/// Check what a buffer in imported memory needs, and leave the memory's own type in `types`, if it is known. Errors:
/// kInvalidArgument.
Status check_import(const ExternalMemory& from, const VkMemoryRequirements& needs,
                    std::vector<std::uint32_t>& types);

/// Allocate memory that can be exported, or import that of `from`.
VkResult allocate_external(Device& device, VkMemoryAllocateInfo& info, const ExternalMemory* from,
                           VkDeviceMemory& memory);

}  // namespace splat::vk

/* libsplat: tensors in memory that other APIs and processes open, without a copy.
 *
 *   splat_tensor_desc desc = {.struct_size = sizeof desc, .flags = SPLAT_TENSOR_EXPORTABLE,
 *                             .rank = 1, .dims = {1000}};
 *   splat_external_memory memory = {.struct_size = sizeof memory};
 *   splat_tensor tensor;
 *   splat_tensor_create(device, &desc, &tensor);
 *   splat_tensor_export(tensor, &memory);  // memory.handle: for CUDA, Vulkan, another process
 *
 * Devices that can have SPLAT_FEATURE_EXTERNAL_MEMORY. On others copy by splat_tensor_read and
 * splat_tensor_write.
 *
 * Order is kept by waiting on the host: each call of the library has ended on the device when it
 * returns (not after SPLAT_ERROR_TIMEOUT), and what others do with the memory must have ended (by
 * vkWaitForFences, cuStreamSynchronize) before a call of the library uses the tensor, and before it is
 * mapped or followed by its pointer. There are no semaphores. */
#ifndef SPLAT_EXTERNAL_H
#define SPLAT_EXTERNAL_H

#include "core.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Memory of a device, as one API or process gives it to another. */
typedef struct splat_external_memory {
    uint32_t struct_size;
    uint32_t memory_type; /* 1 + Vulkan's index of its type of memory; 0: not known, device-local */
    /* Linux: a file descriptor, as of VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD_BIT and
     * CU_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD; Windows (never tried): an NT handle, OPAQUE_WIN32 */
    int64_t handle;
    uint64_t memory_bytes;   /* bytes of the whole allocation, which is not dedicated to a buffer */
    uint64_t offset;         /* bytes from its start to the first element */
    uint8_t device_uuid[16]; /* Vulkan's deviceUUID, on NVIDIA also CUDA's; zeros: not checked */
    uint8_t driver_uuid[16]; /* Vulkan's driverUUID; zeros: not checked */
} splat_external_memory;

/* Give others a handle of a tensor's memory, with what they must know to open it: elements are
 * row-major and contiguous. The handle and all who opened it keep the memory alive: it stays valid,
 * with its elements, after the tensor and the device are destroyed and the process has ended.
 * memory    in/out, struct_size set. memory->handle is the caller's, who closes it by close() (on
 *           Windows CloseHandle()), unless an API that opens it takes it, as CUDA does a descriptor.
 *           Each call makes another one
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (struct_size), or
 *   SPLAT_ERROR_INVALID_STATE  made without SPLAT_TENSOR_EXPORTABLE, imported itself, or mapped
 *   SPLAT_ERROR_OUT_OF_DEVICE_MEMORY  no descriptor is left
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_DEVICE_LOST */
SPLAT_API splat_result splat_tensor_export(splat_tensor tensor, splat_external_memory* memory);

/* Create a tensor in memory that splat_tensor_export, another process or another API exported on the
 * same device and driver. The elements are what the memory holds. It must have whole quads of 16 bytes
 * for them, of which the library may overwrite the rest behind the last element. The memory counts to
 * the device's budget, and lives at least as long as the tensor, whatever becomes of its owner.
 * desc      flags 0
 * memory    its handle stays the caller's, who may close it when this returns. A wrong memory_bytes
 *           is refused where the system or the driver knows better, and undefined elsewhere
 * Returns what splat_tensor_create returns, SPLAT_ERROR_INVALID_ARGUMENT also for
 *   a struct_size, a handle that is not open or of no memory that the device opens, UUIDs of another
 *   device or driver, memory_bytes too few for the elements, an offset that is no multiple of the
 *   device's alignment (256 suits all), a memory_type that the device does not have for tensors;
 *   SPLAT_ERROR_UNSUPPORTED also without SPLAT_FEATURE_EXTERNAL_MEMORY */
SPLAT_API splat_result splat_tensor_import(splat_device device, const splat_tensor_desc* desc,
                                           const splat_external_memory* memory,
                                           splat_tensor* tensor);

#ifdef __cplusplus
}
#endif

#endif /* SPLAT_EXTERNAL_H */

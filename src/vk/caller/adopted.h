#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace splat::vk {

/// Keeps others from a queue. Without functions nobody else uses it.
struct QueueLock {
    void (*lock)(void*) = nullptr;
    void (*unlock)(void*) = nullptr;
    void* user = nullptr;
};

/// A device of the application, which stays its owner. Handles are opaque, as in include/splat/vulkan.h.
struct Adopted {
    void (*get_instance_proc_addr)() = nullptr;
    void* instance = nullptr;
    void* physical_device = nullptr;
    void* device = nullptr;
    void* queue = nullptr;
    std::uint32_t queue_family = 0;
    std::uint32_t api_version = 0;  ///< the instance's
    std::vector<std::string> extensions;
    const void* features = nullptr;  ///< read only while the device is opened
    QueueLock lock;
};

}  // namespace splat::vk

#pragma once

#include <volk.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "core/no_copy.h"
#include "core/status.h"
#include "vk/caller/adopted.h"

namespace splat::vk {

/// One VkInstance, shared by all devices with the same choice of validation.
///
/// Holds its own function pointers: volk's globals are used only to reach the loader.
class Instance : NoCopy {
  public:
    /// The existing instance or a new one. Errors: kNoDevice without loader or driver, kUnsupported
    /// if validation is requested and the Khronos layer is missing, kOutOfHostMemory. Thread-safe.
    static Result<std::shared_ptr<Instance>> get(bool validation);

    /// The application's, which stays alive. Errors: kInvalidState in a forked child, kNoDevice.
    static Result<std::shared_ptr<Instance>> adopt(const Adopted& from);

    ~Instance();

    [[nodiscard]] VkInstance handle() const { return instance_; }
    [[nodiscard]] bool validation() const { return validation_; }
    [[nodiscard]] const std::vector<VkPhysicalDevice>& physical_devices() const { return devices_; }

    PFN_vkGetPhysicalDeviceProperties2 get_properties2 = nullptr;
    PFN_vkGetPhysicalDeviceFeatures2 get_features2 = nullptr;
    PFN_vkGetPhysicalDeviceMemoryProperties get_memory_properties = nullptr;
    PFN_vkGetPhysicalDeviceQueueFamilyProperties get_queue_families = nullptr;
    PFN_vkGetPhysicalDeviceExternalBufferProperties get_external_buffer = nullptr;
    PFN_vkCreateDevice create_device = nullptr;
    PFN_vkEnumerateDeviceExtensionProperties get_extensions = nullptr;

    /// Fill the table of a device's functions. kInvalidArgument if they are unknown. Thread-safe.
    Status load(VolkDeviceTable& table, VkDevice device) const;

    /// True if the driver offers the extension.
    [[nodiscard]] bool has_extension(VkPhysicalDevice device, const char* name) const;

  private:
    Instance() = default;
    static Result<std::shared_ptr<Instance>> create(bool validation);
    Status load_functions();
    Status create_messenger();
    Status enumerate();

    VkInstance instance_ = VK_NULL_HANDLE;
    PFN_vkGetInstanceProcAddr get_function_ = nullptr;
    PFN_vkGetDeviceProcAddr get_device_function_ = nullptr;
    VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
    bool validation_ = false;
    std::vector<VkPhysicalDevice> devices_;
    PFN_vkDestroyInstance destroy_instance_ = nullptr;
    PFN_vkDestroyDebugUtilsMessengerEXT destroy_messenger_ = nullptr;
};

/// Warnings and errors of the validation layer in this process so far; each also went to the log.
std::uint64_t validation_messages();

/// "VK_ERROR_DEVICE_LOST" and so on.
const char* result_name(VkResult result);

}  // namespace splat::vk

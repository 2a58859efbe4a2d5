#pragma once

#include <volk.h>

#include <atomic>
#include <mutex>

#include "api/raster_calls.h"

namespace splat::test {

/// What an application makes, where it is not what the library needs.
struct ApplicationDesc {
    std::uint32_t api_version = VK_API_VERSION_1_2;
    bool timeline = true;
    bool int64 = true;
};

/// An application with its own Vulkan device, under the validation layer with its checks of synchronisation; messages
/// fail the test when it ends, also those of what is still alive on the device then.
class Application {
  public:
    explicit Application(const ApplicationDesc& desc = {});
    Application(const Application&) = delete;
    Application& operator=(const Application&) = delete;
    ~Application();

    [[nodiscard]] splat_vulkan_requirements requirements();
    /// With callbacks that lock `queue_mutex`.
    [[nodiscard]] splat_vulkan_desc desc();
    [[nodiscard]] Device open();

    /// A target image, and one in a buffer that the host sees.
    VkImage make_image(std::uint32_t width, std::uint32_t height, VkFormat format);
    VkBuffer make_buffer(std::uint64_t bytes, std::byte** host);
    VkSemaphore make_timeline();

    /// Copy an image of 4 bytes a pixel behind a frame, by a submit that waits for it on the device. The bytes are
    /// there after idle().
    const std::byte* copy(VkImage image, const splat_vulkan_target& target,
                          const splat_vulkan_frame& frame, std::uint32_t width,
                          std::uint32_t height);
    /// Submit nothing, as an application does on its queue at any time.
    void submit_nothing();
    void idle();
    void wait(const splat_vulkan_frame& frame) const;

    std::mutex queue_mutex;
    std::atomic<int> locks{0}, unlocks{0}, nested{0};
    std::atomic<int> messages{0};

    VkInstance instance = VK_NULL_HANDLE;
    VkPhysicalDevice physical = VK_NULL_HANDLE;
    VkDevice device = VK_NULL_HANDLE;
    VkQueue queue = VK_NULL_HANDLE;
    std::uint32_t family = 0;

  private:
    void make_instance(std::uint32_t api_version);
    void make_device(const ApplicationDesc& desc);
    VkDeviceMemory allocate(const VkMemoryRequirements& needs, VkMemoryPropertyFlags flags);

    std::uint32_t api_version_ = 0;
    VkPhysicalDeviceVulkan12Features v12_{};
    VkPhysicalDeviceFeatures2 features_{};
    VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
    VkCommandPool pool_ = VK_NULL_HANDLE;
    std::vector<VkDeviceMemory> memories_;
    std::vector<VkImage> images_;
    std::vector<VkBuffer> buffers_;
    std::vector<VkSemaphore> semaphores_;
};

}  // namespace splat::test

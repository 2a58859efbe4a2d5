#pragma once

#include <volk.h>

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace vkrun::bench {

struct RawBuffer {
    VkBuffer buffer = VK_NULL_HANDLE;
    VkDeviceMemory memory = VK_NULL_HANDLE;
    VkDeviceSize bytes = 0;
};

struct RawPipeline {
    VkPipeline pipeline = VK_NULL_HANDLE;
    VkPipelineLayout layout = VK_NULL_HANDLE;
    VkDescriptorSet set = VK_NULL_HANDLE;

    /// Bind the pipeline, its buffers and the push constants.
    void bind(VkCommandBuffer to, std::array<std::uint32_t, 3> push) const;
};

/// Times of one submission, ms.
struct RunTimes {
    double record_ms = 0;
    double wall_ms = 0;               ///< from the submit to the fence
    std::optional<double> device_ms;  ///< between two timestamps; empty on a device without them
    [[nodiscard]] double ms() const { return device_ms.value_or(wall_ms); }
};

/// A Vulkan device without libsplat between, to measure what Vulkan itself costs. Objects live until the device
/// is closed. Each call throws a Failure that names the failed one.
class RawVulkan {
  public:
    /// The device of this UUID, as splat_device_info has it.
    explicit RawVulkan(std::span<const std::uint8_t, 16> uuid);
    ~RawVulkan();
    RawVulkan(const RawVulkan&) = delete;
    RawVulkan& operator=(const RawVulkan&) = delete;

    /// A storage buffer that is also copied from and to. Returns nothing if the device has no memory with all of the
    /// `wanted` properties and none of the `unwanted` ones.
    std::optional<RawBuffer> buffer(VkDeviceSize bytes, VkMemoryPropertyFlags wanted,
                                    VkMemoryPropertyFlags unwanted = 0);
    void free(RawBuffer& buffer);
    void* map(const RawBuffer& buffer);
    /// Make what the device wrote visible, in memory that is cached and not coherent.
    void invalidate(const RawBuffer& buffer);

    /// A compute shader with push constants of 12 bytes and the buffers at bindings 0, 1, ...
    RawPipeline pipeline(std::span<const std::uint32_t> spirv,
                         const std::vector<RawBuffer>& buffers, std::uint32_t constant = 0);

    /// Record and run.
    RunTimes run(const std::function<void(VkCommandBuffer)>& record);
    /// Wall time of a submission, ms, of the buffer that run() recorded last; without one, of no buffer.
    double submit(bool with_commands);

    [[nodiscard]] const VkPhysicalDeviceMemoryProperties& memory() const { return memory_; }
    [[nodiscard]] const VkPhysicalDeviceLimits& limits() const { return properties_.limits; }
    [[nodiscard]] const std::vector<std::string>& extensions() const { return extensions_; }
    /// Smallest and largest number of lanes of a subgroup; 0 if the device does not say.
    [[nodiscard]] std::array<std::uint32_t, 2> lanes() const { return lanes_; }

  private:
    void find_device(std::span<const std::uint8_t, 16> uuid);
    void describe();
    void open_device();
    std::optional<std::uint32_t> memory_type(std::uint32_t allowed, VkMemoryPropertyFlags wanted,
                                             VkMemoryPropertyFlags unwanted) const;

    VkInstance instance_ = VK_NULL_HANDLE;
    VkPhysicalDevice physical_ = VK_NULL_HANDLE;
    VkDevice device_ = VK_NULL_HANDLE;
    VkQueue queue_ = VK_NULL_HANDLE;
    std::uint32_t family_ = 0;
    std::uint32_t timestamp_bits_ = 0;
    VkPhysicalDeviceProperties properties_{};
    VkPhysicalDeviceMemoryProperties memory_{};
    std::array<std::uint32_t, 2> lanes_{};
    std::vector<std::string> extensions_;
    VkCommandPool pool_ = VK_NULL_HANDLE;
    VkCommandBuffer commands_ = VK_NULL_HANDLE;
    VkFence fence_ = VK_NULL_HANDLE;
    VkQueryPool queries_ = VK_NULL_HANDLE;
    VkDescriptorPool descriptors_ = VK_NULL_HANDLE;
    std::vector<RawBuffer> buffers_;
    std::vector<VkShaderModule> modules_;
    std::vector<VkDescriptorSetLayout> set_layouts_;
    std::vector<RawPipeline> pipelines_;
};

}  // namespace vkrun::bench

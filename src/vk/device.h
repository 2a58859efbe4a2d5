#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "vk/instance.h"

namespace splat::vk {

enum class DeviceKind : int { kOther = 1, kCpu = 2, kVirtual = 3, kIntegrated = 4, kDiscrete = 5 };

/// The set of shaders in use; see splat_kernels in include/splat.h.
enum class Kernels : int { kAuto = 0, kPlain = 1, kCpu = 2, kGpu = 3 };

const char* kernels_name(Kernels kernels);
const char* device_kind_name(DeviceKind kind);

/// What the device allows. The rest of the code asks these fields, never the vendor.
struct DeviceLimits {
    std::uint64_t max_storage_buffer_bytes = 0;  ///< one binding
    std::uint32_t max_storage_buffers = 0;       ///< bindings of one shader
    std::uint64_t max_texel_elements = 0;        ///< one texel-buffer binding
    std::uint64_t max_allocation_bytes = 0;
    std::uint64_t heap_bytes = 0;  ///< largest device-local heap
    std::uint64_t offset_alignment =
        0;  ///< bytes; satisfies storage, texel and non-coherent-atom alignment
    std::array<std::uint32_t, 3> max_groups{};
    std::array<std::uint32_t, 3> max_group_size{};
    std::uint32_t max_group_invocations = 0;
    std::uint32_t shared_memory_bytes = 0;
    std::uint32_t push_constant_bytes = 0;
    std::uint32_t subgroup_size = 0;
    double timestamp_ns = 0;           ///< nanoseconds per tick; 0 = no timestamps
    std::uint64_t timestamp_mask = 0;  ///< the valid bits of a tick count
};

struct DeviceFeatures {
    bool subgroup_shuffle = false;  ///< with ballot and vote
    bool subgroup_arithmetic = false;
    bool int64 = false;
    bool unified_memory = false;
    bool many_registers = false;    ///< a CPU with 32 vector registers (AVX-512)
    bool large_code_cache = false;  ///< a CPU whose instruction cache holds loops of 40 KB
    bool packed_stores = true;  ///< false on CPUs that store pairs of floats slowly, see store.glsl
};

struct DeviceInfo {
    std::uint32_t index = 0;
    DeviceKind kind = DeviceKind::kOther;
    std::string name;
    std::string driver;
    std::string reason;  ///< why it is not usable; empty if usable
    std::uint32_t vendor_id = 0;
    std::uint32_t device_id = 0;
    std::uint32_t vulkan_version = 0;
    std::uint32_t driver_version = 0;
    std::array<std::uint8_t, VK_UUID_SIZE> uuid{};
    std::array<std::uint8_t, VK_UUID_SIZE> cache_uuid{};  ///< pipelineCacheUUID
    DeviceLimits limits;
    DeviceFeatures features;
    std::uint32_t queue_family = 0;
    Kernels kernels = Kernels::kPlain;  ///< what kAuto means here

    [[nodiscard]] bool usable() const { return reason.empty(); }
};

enum class DeviceSelect : int { kBest = 0, kByIndex = 1, kByUuid = 2, kByKind = 3 };

struct DeviceDesc {
    DeviceSelect select = DeviceSelect::kBest;
    std::uint32_t index = 0;
    std::array<std::uint8_t, VK_UUID_SIZE> uuid{};
    DeviceKind kind = DeviceKind::kOther;
    Kernels kernels = Kernels::kAuto;
    bool validation = false;
    std::function<void(DeviceInfo&)> fake;  ///< tests: lower limits or remove features
};

/// Describe all devices of an instance, usable or not.
Result<std::vector<DeviceInfo>> describe_devices(const Instance& instance);

/// What a list of one submit is encoded into. Lists hand it on, because drivers of discrete devices take up to a
/// millisecond to make it, and each transfer is a list.
struct CommandBuffer {
    VkCommandPool pool = VK_NULL_HANDLE;
    VkCommandBuffer buffer = VK_NULL_HANDLE;
    VkFence fence = VK_NULL_HANDLE;
};

/// A logical device with one compute queue and its own function table.
class Device : NoCopy {
  public:
    /// Errors: kNoDevice (no device fits; lists all), kUnsupported (names what is missing),
    /// kInvalidArgument (SPLAT_KERNELS).
    static Result<std::unique_ptr<Device>> create(const DeviceDesc& desc);

    ~Device();

    [[nodiscard]] VkDevice handle() const { return device_; }
    [[nodiscard]] VkQueue queue() const { return queue_; }
    [[nodiscard]] const DeviceInfo& info() const { return info_; }
    [[nodiscard]] Kernels kernels() const { return kernels_; }
    /// Call it before anything on the device has the layout of other kernels.
    void use_plain_kernels() { kernels_ = Kernels::kPlain; }
    [[nodiscard]] const VkPhysicalDeviceMemoryProperties& memory_properties() const {
        return memory_;
    }

    /// Turns a VkResult into a Status; remembers device loss.
    Status check(VkResult result, const char* call);

    /// kDeviceLost if any call before reported it.
    [[nodiscard]] Status alive() const;

    /// Destroy the VkDevice alone: the process exits, and what else is there is left to it. See device_exit.h.
    void end_at_exit() noexcept;

    /// Command buffers that no list uses; at most kMostSpare. Guarded as the context is.
    static constexpr std::size_t kMostSpare = 8;
    std::vector<CommandBuffer> spare;

    VolkDeviceTable
        vk{};  ///< every device-level Vulkan call goes through here; tests replace entries

  private:
    Device() = default;
    Status choose_kernels(Kernels wish);
    Status open();

    std::shared_ptr<Instance> instance_;
    VkPhysicalDevice physical_ = VK_NULL_HANDLE;
    VkDevice device_ = VK_NULL_HANDLE;
    VkQueue queue_ = VK_NULL_HANDLE;
    DeviceInfo info_;
    Kernels kernels_ = Kernels::kPlain;
    VkPhysicalDeviceMemoryProperties memory_{};
    std::atomic<bool> lost_{false};
};

}  // namespace splat::vk

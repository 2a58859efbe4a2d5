#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "vk/instance.h"
#include "vk/pace.h"

namespace splat::vk {

enum class DeviceKind : int { kOther = 1, kCpu = 2, kVirtual = 3, kIntegrated = 4, kDiscrete = 5 };

/// The set of shaders in use; see splat_kernels in include/splat.h.
enum class Kernels : int { kAuto = 0, kPlain = 1, kCpu = 2, kGpu = 3 };

/// Kernels that are chosen, tested and replaced together: those of operators, those that make the lists of tiles,
/// and those that blend them.
enum class Family : int { kNetwork = 0, kSort = 1, kBlend = 2 };
inline constexpr Family kFamilies[] = {Family::kNetwork, Family::kSort, Family::kBlend};

/// The kernels of each family.
using FamilyKernels = std::array<Kernels, std::size(kFamilies)>;

const char* kernels_name(Kernels kernels);
const char* family_name(Family family);
/// "gpu", or "network gpu, sort plain, blend gpu".
std::string kernels_text(const FamilyKernels& kernels);
/// Kernels for CPUs sort and blend together: both become plain.
void make_plain(FamilyKernels& kernels, Family family);
const char* device_kind_name(DeviceKind kind);

/// What the device allows. The rest of the code asks these fields, never the vendor.
struct DeviceLimits {
    std::uint64_t max_storage_buffer_bytes = 0;  ///< one binding; at most one allocation
    std::uint32_t max_storage_buffers = 0;       ///< bindings of one shader
    std::uint64_t max_texel_elements = 0;        ///< one texel-buffer binding
    std::uint64_t max_buffer_bytes = 0;          ///< one buffer; ~0 if the driver does not say
    std::uint64_t max_allocation_bytes = 0;      ///< one allocation; at most one buffer
    std::uint64_t heap_bytes = 0;  ///< largest device-local heap; on integrated devices the largest
    std::uint64_t offset_alignment =
        0;  ///< bytes; satisfies storage, texel and non-coherent-atom alignment
    std::array<std::uint32_t, 3> max_groups{};
    std::array<std::uint32_t, 3> max_group_size{};
    std::uint32_t max_group_invocations = 0;
    std::uint32_t shared_memory_bytes = 0;
    std::uint32_t push_constant_bytes = 0;
    std::uint32_t subgroup_size = 0;  ///< what shaders are told
    std::uint32_t least_lanes = 0;    ///< what a subgroup may really have
    std::uint32_t most_lanes = 0;
    double timestamp_ns = 0;           ///< nanoseconds per tick; 0 = no timestamps
    std::uint64_t timestamp_mask = 0;  ///< the valid bits of a tick count
    /// What an operator that can work in slices writes at a time for its next kernel to read. Not asked of the device:
    /// 16 MiB stay in the caches of most processors.
    std::uint64_t slice_bytes = std::uint64_t{16} << 20;

    /// Most subgroups of a workgroup in which fast kernels run: they have 8 lanes or more. Shaders end where a
    /// driver runs smaller ones.
    [[nodiscard]] std::uint32_t subgroups(std::uint32_t workgroup) const {
        const std::uint32_t lanes = std::max(least_lanes, kLeastLanes);
        return (workgroup + lanes - 1) / lanes;
    }
    static constexpr std::uint32_t kLeastLanes = 8;
};

struct DeviceFeatures {
    bool subgroup_shuffle = false;  ///< with vote
    bool subgroup_ballot = false;
    bool subgroup_arithmetic = false;
    bool int64 = false;
    bool unified_memory = false;    ///< the host reads device memory in place, through its caches
    bool many_registers = false;    ///< a CPU with 32 vector registers (AVX-512)
    bool large_code_cache = false;  ///< a CPU whose instruction cache holds loops of 40 KB
    bool packed_stores = true;  ///< false on CPUs that store pairs of floats slowly, see store.glsl
    bool nan_mode = false;      ///< takes the mode of keep_nan.glsl; CPUs need none
    bool levels =
        false;  ///< lists run in levels of dependency, see levels.h; SPLAT_LEVELS overrides it
    bool external_memory = false;  ///< see external_memory.h
};

struct DeviceInfo {
    std::uint32_t index = 0;
    DeviceKind kind = DeviceKind::kOther;
    std::string name;
    std::string driver;
    std::string reason;       ///< why it is not usable; empty if usable
    std::string passed_over;  ///< why another is chosen before this usable one; else empty
    VkDriverId driver_id{};
    bool conformant = true;  ///< the driver passed Khronos's tests of some version
    std::uint32_t vendor_id = 0;
    std::uint32_t device_id = 0;
    std::uint32_t vulkan_version = 0;
    std::uint32_t driver_version = 0;
    std::array<std::uint8_t, VK_UUID_SIZE> uuid{};
    std::array<std::uint8_t, VK_UUID_SIZE> driver_uuid{};
    std::array<std::uint8_t, VK_UUID_SIZE> cache_uuid{};  ///< pipelineCacheUUID
    DeviceLimits limits;
    DeviceFeatures features;
    std::uint32_t queue_family = 0;
    FamilyKernels kernels = {Kernels::kPlain, Kernels::kPlain,
                             Kernels::kPlain};  ///< what kAuto means here

    [[nodiscard]] bool usable() const { return reason.empty(); }
};

/// The kernels that a device takes. CPU devices take all families' or none: kernels for them do not differ in what they
/// need.
FamilyKernels best_kernels(const DeviceInfo& info);

enum class DeviceSelect : int { kBest = 0, kByIndex = 1, kByUuid = 2, kByKind = 3 };

struct DeviceDesc {
    DeviceSelect select = DeviceSelect::kBest;
    std::uint32_t index = 0;
    std::array<std::uint8_t, VK_UUID_SIZE> uuid{};
    DeviceKind kind = DeviceKind::kOther;
    Kernels kernels = Kernels::kAuto;
    bool validation = false;
    std::uint64_t max_submit_ns = 0;      ///< see Pace; SPLAT_MAX_SUBMIT_MS overrides it
    std::optional<Adopted> adopted = {};  ///< instead of a device that is chosen and opened
    /// Tests: lower limits or remove features. Called for every device, before one is chosen.
    std::function<void(DeviceInfo&)> fake;
};

/// The compute family without graphics if there is one: it runs in parallel with a desktop's drawing.
std::optional<std::uint32_t> compute_family(const std::vector<VkQueueFamilyProperties>& families);

/// `family`: of the queue that is used; else compute_family().
DeviceInfo describe_device(const Instance& instance, VkPhysicalDevice physical, std::uint32_t index,
                           std::optional<std::uint32_t> family = {});

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
    /// For DeviceSelect::kBest the next device is tried where the driver does not open one.
    /// Errors: kNoDevice (no device fits; lists all), kUnsupported (names what is missing),
    /// kInvalidArgument (SPLAT_KERNELS), and the driver's of the last device tried.
    static Result<std::unique_ptr<Device>> create(const DeviceDesc& desc);

    ~Device();

    [[nodiscard]] VkDevice handle() const { return device_; }
    [[nodiscard]] VkQueue queue() const { return queue_; }
    /// For who holds a QueueUse. An application's queue is waited for by fences, as its own work may be there.
    [[nodiscard]] bool adopted() const { return adopted_; }
    [[nodiscard]] const DeviceInfo& info() const { return info_; }
    [[nodiscard]] Kernels kernels(Family family = Family::kNetwork) const {
        return kernels_[static_cast<std::size_t>(family)];
    }
    [[nodiscard]] const FamilyKernels& all_kernels() const { return kernels_; }
    /// Call it before anything on the device has the layout of the family's other kernels.
    void use_plain_kernels(Family family) { make_plain(kernels_, family); }
    [[nodiscard]] const VkPhysicalDeviceMemoryProperties& memory_properties() const {
        return memory_;
    }

    /// kUnsupported if a shader has more storage buffers than the device binds at once.
    [[nodiscard]] Status check_storage_buffers(const char* shader, std::uint32_t needed) const;

    /// Turns a VkResult into a Status; remembers device loss.
    Status check(VkResult result, const char* call);

    /// kDeviceLost if any call before reported it.
    [[nodiscard]] Status alive() const;

    /// Destroy the VkDevice alone: the process exits, and what else is there is left to it. See device_exit.h.
    void end_at_exit() noexcept;

    /// Command buffers that no list uses; at most kMostSpare. Guarded as the context is.
    static constexpr std::size_t kMostSpare = 8;
    std::vector<CommandBuffer> spare;

    Pace pace;

    VolkDeviceTable
        vk{};  ///< every device-level Vulkan call goes through here; tests replace entries

  private:
    friend class QueueUse;
    Device() = default;
    static Result<std::unique_ptr<Device>> adopt(const DeviceDesc& desc);
    /// What the caller and the environment say of it.
    Status choose(const DeviceDesc& desc);
    Status choose_kernels(Kernels wish);
    Status open();

    std::shared_ptr<Instance> instance_;
    VkPhysicalDevice physical_ = VK_NULL_HANDLE;
    VkDevice device_ = VK_NULL_HANDLE;
    VkQueue queue_ = VK_NULL_HANDLE;
    DeviceInfo info_;
    FamilyKernels kernels_ = DeviceInfo().kernels;
    VkPhysicalDeviceMemoryProperties memory_{};
    QueueLock lock_;
    bool adopted_ = false;
    std::atomic<bool> lost_{false};
};

/// Hold it during each call that names the queue.
class QueueUse : NoCopy {
  public:
    explicit QueueUse(const Device& device) : lock_(device.lock_) {
        if (lock_.lock != nullptr) lock_.lock(lock_.user);
    }
    ~QueueUse() {
        if (lock_.unlock != nullptr) lock_.unlock(lock_.user);
    }

  private:
    const QueueLock& lock_;
};

}  // namespace splat::vk

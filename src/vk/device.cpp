#include "vk/device.h"

#include <algorithm>
#include <cstring>

#include "core/environment.h"
#include "core/fault.h"
#include "core/log.h"
#include "core/os/memory.h"
#include "core/parallel.h"
#include "vk/device_choice.h"
#include "vk/device_exit.h"
#include "vk/external_memory.h"

namespace splat::vk {
namespace {

DeviceKind kind_of(VkPhysicalDeviceType type) {
    switch (type) {
        case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
            return DeviceKind::kDiscrete;
        case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
            return DeviceKind::kIntegrated;
        case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
            return DeviceKind::kVirtual;
        case VK_PHYSICAL_DEVICE_TYPE_CPU:
            return DeviceKind::kCpu;
        default:
            return DeviceKind::kOther;
    }
}

void read_memory(const VkPhysicalDeviceMemoryProperties& memory, DeviceInfo& info) {
    for (std::uint32_t i = 0; i < memory.memoryHeapCount; ++i)
        // The heaps of an integrated device are one memory, of which the local one may be a small part.
        if ((memory.memoryHeaps[i].flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT) != 0 ||
            info.kind == DeviceKind::kIntegrated)
            info.limits.heap_bytes = std::max(info.limits.heap_bytes, memory.memoryHeaps[i].size);
    for (std::uint32_t i = 0; i < memory.memoryTypeCount; ++i) {
        const VkMemoryPropertyFlags all = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT |
                                          VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT |
                                          VK_MEMORY_PROPERTY_HOST_CACHED_BIT;
        // Write-combined memory and a resizable BAR are also host-visible, but slow to read.
        if ((memory.memoryTypes[i].propertyFlags & all) == all &&
            info.kind != DeviceKind::kDiscrete)
            info.features.unified_memory = true;
    }
}

constexpr std::uint32_t kFastInvocations = 256;

/// Shared memory of radix_sort_downsweep_gpu.comp: 256 counters, and as many for each subgroup of 128 invocations.
std::uint32_t sort_shared_bytes(const DeviceLimits& limits) {
    return 256 * 4 * (1 + limits.subgroups(128));
}

/// Whether a family's fast kernels may run. Those of networks read 8 lanes through constant shuffles
/// (shaders/ops/conv2d_forward_fast.comp), so they need subgroups of 8 or more. Those that blend need more of a
/// subgroup, too (blend.cpp).
bool suits(const DeviceInfo& info, Family family) {
    const DeviceLimits& limits = info.limits;
    if (limits.max_group_invocations < kFastInvocations) return false;
    const bool lanes = limits.subgroup_size >= DeviceLimits::kLeastLanes;
    if (family == Family::kNetwork) return lanes && info.features.subgroup_shuffle;
    return family == Family::kBlend || (lanes && info.features.subgroup_ballot &&
                                        limits.shared_memory_bytes >= sort_shared_bytes(limits));
}

bool suits_all(const DeviceInfo& info) {
    return std::ranges::all_of(kFamilies, [&](Family family) { return suits(info, family); });
}

/// True if this machine's CPU, which is also a CPU device, has 32 vector registers.
bool host_has_many_registers() {
#if defined(__GNUC__) && defined(__x86_64__)
    return __builtin_cpu_supports("avx512vl") != 0;
#else
    return false;
#endif
}

bool host_has_large_code_cache() {
    return os::code_cache_bytes() >= 64 << 10;
}

/// False on Intel CPUs with AVX-512, see shaders/include/store.glsl. AMD CPUs are 1.45 times as fast with packed
/// stores (Zen 5).
bool host_prefers_packed_stores() {
#if defined(__GNUC__) && defined(__x86_64__)
    return __builtin_cpu_is("intel") == 0 || __builtin_cpu_supports("avx512f") == 0;
#else
    return true;
#endif
}

std::string why_unusable(const DeviceInfo& info, bool has_queue) {
    if (info.vulkan_version < VK_API_VERSION_1_2)
        return format("Vulkan %u.%u, libsplat needs 1.2 or later",
                      VK_API_VERSION_MAJOR(info.vulkan_version),
                      VK_API_VERSION_MINOR(info.vulkan_version));
    if (!has_queue) return "no queue family with compute";
    return "";
}

/// Properties that Vulkan 1.3 has, and an extension before; zeros where the driver has neither.
template <class Properties>
Properties properties_of(const Instance& instance, VkPhysicalDevice physical, std::uint32_t version,
                         VkStructureType type, const char* extension) {
    Properties found{};
    found.sType = type;
    VkPhysicalDeviceProperties2 properties{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2,
                                           .pNext = &found};
    if (version >= VK_API_VERSION_1_3 || instance.has_extension(physical, extension))
        instance.get_properties2(physical, &properties);
    return found;
}

/// Largest buffer, and how many lanes a subgroup may have.
void read_later_limits(const Instance& instance, VkPhysicalDevice physical, std::uint32_t version,
                       DeviceLimits& limits) {
    const std::uint64_t bytes =
        properties_of<VkPhysicalDeviceMaintenance4Properties>(
            instance, physical, version, VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_4_PROPERTIES,
            VK_KHR_MAINTENANCE_4_EXTENSION_NAME)
            .maxBufferSize;
    const auto lanes = properties_of<VkPhysicalDeviceSubgroupSizeControlProperties>(
        instance, physical, version,
        VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_SIZE_CONTROL_PROPERTIES,
        VK_EXT_SUBGROUP_SIZE_CONTROL_EXTENSION_NAME);
    limits.max_buffer_bytes = bytes != 0 ? bytes : ~std::uint64_t{0};
    limits.least_lanes = lanes.minSubgroupSize != 0 ? lanes.minSubgroupSize : limits.subgroup_size;
    limits.most_lanes = std::max(lanes.maxSubgroupSize, limits.subgroup_size);
}

/// What follows from the other fields: a binding lies within a buffer, which has an allocation of its own.
void complete(DeviceInfo& info) {
    DeviceLimits& limits = info.limits;
    limits.max_allocation_bytes = std::min(limits.max_allocation_bytes, limits.max_buffer_bytes);
    limits.max_storage_buffer_bytes =
        std::min(limits.max_storage_buffer_bytes, limits.max_allocation_bytes);
    info.kernels = best_kernels(info);
}

}  // namespace

std::optional<std::uint32_t> compute_family(const std::vector<VkQueueFamilyProperties>& families) {
    std::optional<std::uint32_t> found;
    for (std::uint32_t i = 0; i < families.size(); ++i) {
        if ((families[i].queueFlags & VK_QUEUE_COMPUTE_BIT) == 0) continue;
        if ((families[i].queueFlags & VK_QUEUE_GRAPHICS_BIT) == 0) return i;
        if (!found) found = i;
    }
    return found;
}

DeviceInfo describe_device(const Instance& instance, VkPhysicalDevice physical, std::uint32_t index,
                           std::optional<std::uint32_t> family) {
    VkPhysicalDeviceVulkan12Properties p12{};
    p12.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_PROPERTIES;
    VkPhysicalDeviceVulkan11Properties p11{};
    p11.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_PROPERTIES;
    p11.pNext = &p12;
    VkPhysicalDeviceProperties2 properties{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2,
                                           .pNext = &p11};
    instance.get_properties2(physical, &properties);
    VkPhysicalDeviceFeatures2 features{};
    features.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2;
    instance.get_features2(physical, &features);

    const VkPhysicalDeviceProperties& core = properties.properties;
    DeviceInfo info{.index = index,
                    .kind = kind_of(core.deviceType),
                    .name = core.deviceName,
                    .driver = std::string(p12.driverName) + " " + p12.driverInfo,
                    .driver_id = p12.driverID,
                    .conformant = p12.conformanceVersion.major != 0,
                    .vendor_id = core.vendorID,
                    .device_id = core.deviceID,
                    .vulkan_version = core.apiVersion,
                    .driver_version = core.driverVersion};
    std::copy_n(p11.deviceUUID, VK_UUID_SIZE, info.uuid.begin());
    std::copy_n(p11.driverUUID, VK_UUID_SIZE, info.driver_uuid.begin());
    std::copy_n(core.pipelineCacheUUID, VK_UUID_SIZE, info.cache_uuid.begin());

    DeviceLimits& limits = info.limits;
    limits.max_storage_buffer_bytes = core.limits.maxStorageBufferRange;
    limits.max_storage_buffers = core.limits.maxPerStageDescriptorStorageBuffers;
    limits.max_texel_elements = core.limits.maxTexelBufferElements;
    limits.max_allocation_bytes = p11.maxMemoryAllocationSize;
    limits.offset_alignment = std::max({core.limits.minStorageBufferOffsetAlignment,
                                        core.limits.minTexelBufferOffsetAlignment,
                                        core.limits.nonCoherentAtomSize, VkDeviceSize{16}});
    std::copy_n(core.limits.maxComputeWorkGroupCount, 3, limits.max_groups.begin());
    std::copy_n(core.limits.maxComputeWorkGroupSize, 3, limits.max_group_size.begin());
    limits.max_group_invocations = core.limits.maxComputeWorkGroupInvocations;
    limits.shared_memory_bytes = core.limits.maxComputeSharedMemorySize;
    limits.push_constant_bytes = core.limits.maxPushConstantsSize;
    limits.subgroup_size = p11.subgroupSize;
    read_later_limits(instance, physical, core.apiVersion, limits);

    const bool compute_subgroups = (p11.subgroupSupportedStages & VK_SHADER_STAGE_COMPUTE_BIT) != 0;
    const auto has_operations = [&](VkSubgroupFeatureFlags wanted) {
        return compute_subgroups && (p11.subgroupSupportedOperations & wanted) == wanted;
    };
    info.features.subgroup_shuffle =
        has_operations(VK_SUBGROUP_FEATURE_SHUFFLE_BIT | VK_SUBGROUP_FEATURE_VOTE_BIT);
    info.features.subgroup_ballot = has_operations(VK_SUBGROUP_FEATURE_BALLOT_BIT);
    info.features.subgroup_arithmetic = has_operations(VK_SUBGROUP_FEATURE_ARITHMETIC_BIT);
    info.features.int64 = features.features.shaderInt64 == VK_TRUE;
    info.features.nan_mode =
        info.kind != DeviceKind::kCpu && p12.shaderSignedZeroInfNanPreserveFloat32 == VK_TRUE;
    info.features.many_registers = info.kind == DeviceKind::kCpu && host_has_many_registers();
    info.features.large_code_cache = info.kind == DeviceKind::kCpu && host_has_large_code_cache();
    info.features.external_memory = has_external_memory(instance, physical);
    info.features.packed_stores = host_prefers_packed_stores();
    info.features.levels = info.kind != DeviceKind::kCpu;  // these find recent data in their caches

    VkPhysicalDeviceMemoryProperties memory{};
    instance.get_memory_properties(physical, &memory);
    read_memory(memory, info);

    std::uint32_t count = 0;
    instance.get_queue_families(physical, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    instance.get_queue_families(physical, &count, families.data());
    if (!family) family = compute_family(families);
    info.queue_family = family.value_or(0);
    if (family && families[*family].timestampValidBits > 0) {
        limits.timestamp_ns = static_cast<double>(core.limits.timestampPeriod);
        limits.timestamp_mask = ~std::uint64_t{0} >> (64 - families[*family].timestampValidBits);
    }
    info.reason = why_unusable(info, family.has_value());
    complete(info);
    return info;
}

namespace {

Result<Kernels> kernels_from_environment(Kernels fallback) {
    const auto text = environment("SPLAT_KERNELS");
    if (!text || *text == "auto") return fallback;
    for (const Kernels k : {Kernels::kPlain, Kernels::kCpu, Kernels::kGpu})
        if (*text == kernels_name(k)) return k;
    return invalid("environment variable SPLAT_KERNELS is '%s', expected auto, plain, cpu or gpu",
                   text->c_str());
}

}  // namespace

FamilyKernels best_kernels(const DeviceInfo& info) {
    FamilyKernels best = DeviceInfo().kernels;
    if (info.kind == DeviceKind::kCpu) {
        // Kernels for CPU devices store floats as 64-bit integers (shaders/include/store.glsl).
        if (suits_all(info)) best.fill(info.features.int64 ? Kernels::kCpu : Kernels::kGpu);
        return best;
    }
    for (const Family family : kFamilies)
        if (suits(info, family)) best[static_cast<std::size_t>(family)] = Kernels::kGpu;
    return best;
}

const char* kernels_name(Kernels kernels) {
    constexpr const char* kNames[] = {"auto", "plain", "cpu", "gpu"};
    return kNames[static_cast<std::size_t>(kernels)];
}

const char* family_name(Family family) {
    constexpr const char* kNames[] = {"network", "sort", "blend"};
    return kNames[static_cast<std::size_t>(family)];
}

std::string kernels_text(const FamilyKernels& kernels) {
    if (std::ranges::count(kernels, kernels[0]) == std::ssize(kernels))
        return kernels_name(kernels[0]);
    std::string text;
    for (const Family family : kFamilies)
        text += format("%s%s %s", text.empty() ? "" : ", ", family_name(family),
                       kernels_name(kernels[static_cast<std::size_t>(family)]));
    return text;
}

void make_plain(FamilyKernels& kernels, Family family) {
    Kernels& replaced = kernels[static_cast<std::size_t>(family)];
    if (family != Family::kNetwork && replaced == Kernels::kCpu)
        kernels[1] = kernels[2] = Kernels::kPlain;
    replaced = Kernels::kPlain;
}

const char* device_kind_name(DeviceKind kind) {
    constexpr const char* kNames[] = {"other", "cpu", "virtual", "integrated", "discrete"};
    return kNames[static_cast<std::size_t>(kind) - 1];
}

Result<std::vector<DeviceInfo>> describe_devices(const Instance& instance) {
    std::vector<DeviceInfo> infos;
    for (const VkPhysicalDevice physical : instance.physical_devices())
        infos.push_back(
            describe_device(instance, physical, static_cast<std::uint32_t>(infos.size())));
    pass_over(infos);
    return infos;
}

Result<std::unique_ptr<Device>> Device::create(const DeviceDesc& desc) {
    if (desc.adopted) return adopt(desc);
    SPLAT_ASSIGN(const std::shared_ptr<Instance> instance, Instance::get(desc.validation));
    SPLAT_ASSIGN(std::vector<DeviceInfo> infos, describe_devices(*instance));
    if (desc.fake) {
        for (DeviceInfo& info : infos) {
            desc.fake(info);
            complete(info);
        }
        pass_over(infos);
    }
    SPLAT_ASSIGN(const std::vector<std::uint32_t> order, devices_to_try(desc, infos));
    Status opened;
    for (const std::uint32_t index : order) {
        std::unique_ptr<Device> device(new Device);
        device->instance_ = instance;
        device->info_ = infos[index];
        device->physical_ = instance->physical_devices()[index];
        const DeviceInfo& info = device->info_;
        SPLAT_TRY(device->choose(desc));
        opened = device->open();
        if (opened.ok()) {
            log(LogLevel::kInfo,
                format("device %u: %s (%s, %s), %s kernels", index, info.name.c_str(),
                       device_kind_name(info.kind), info.driver.c_str(),
                       kernels_text(device->kernels_).c_str()));
            return device;
        }
        if (index != order.back())
            log(LogLevel::kWarning,
                format("device %u (%s) cannot be opened, so the next one is tried: %s", index,
                       info.name.c_str(), opened.message().c_str()));
    }
    return opened;
}

Status Device::choose(const DeviceDesc& desc) {
    if (const auto levels = environment("SPLAT_LEVELS")) {
        if (*levels != "0" && *levels != "1")
            return invalid("environment variable SPLAT_LEVELS is '%s', expected 0 or 1",
                           levels->c_str());
        info_.features.levels = *levels == "1";
    }
    const double milliseconds = static_cast<double>(desc.max_submit_ns) * 1e-6;
    SPLAT_ASSIGN(const double most, environment_positive("SPLAT_MAX_SUBMIT_MS", milliseconds));
    pace = Pace(info_.kind != DeviceKind::kCpu, most * 1e-3);
    return choose_kernels(desc.kernels);
}

Status Device::choose_kernels(Kernels wish) {
    SPLAT_ASSIGN(const Kernels chosen, kernels_from_environment(wish));
    kernels_ = info_.kernels;
    if (chosen == Kernels::kAuto) return {};
    if (chosen != Kernels::kPlain && !suits_all(info_))
        return unsupported(
            "device %u (%s) has subgroups of %u lanes (%u to %u)%s, %u bytes of shared memory and "
            "workgroups of %u; %s kernels need 8 or more with shuffle and ballot, %u and %u: use "
            "plain ones, or leave the choice to the device",
            info_.index, info_.name.c_str(), info_.limits.subgroup_size, info_.limits.least_lanes,
            info_.limits.most_lanes,
            info_.features.subgroup_shuffle && info_.features.subgroup_ballot
                ? ""
                : " without shuffle, ballot or vote",
            info_.limits.shared_memory_bytes, info_.limits.max_group_invocations,
            kernels_name(chosen), sort_shared_bytes(info_.limits), kFastInvocations);
    if (chosen == Kernels::kCpu && !info_.features.int64)
        return unsupported(
            "device %u (%s) has no 64-bit integers in shaders, which cpu kernels need: use "
            "gpu or plain ones",
            info_.index, info_.name.c_str());
    kernels_.fill(chosen);
    return {};
}

Status Device::open() {
    spare.reserve(kMostSpare);  // destructors fill it
    const float priority = 1.0F;
    VkDeviceQueueCreateInfo queue{.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO,
                                  .queueFamilyIndex = info_.queue_family,
                                  .queueCount = 1,
                                  .pQueuePriorities = &priority};

    // Robustness stays off: every shader guards its own accesses. Only GPU-assisted validation needs
    // the store features.
    VkPhysicalDeviceFeatures2 available{};
    available.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2;
    instance_->get_features2(physical_, &available);
    VkPhysicalDeviceFeatures2 wanted{};
    wanted.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2;
    wanted.features.shaderInt64 = info_.features.int64 ? VK_TRUE : VK_FALSE;
    if (instance_->validation()) {
        wanted.features.fragmentStoresAndAtomics = available.features.fragmentStoresAndAtomics;
        wanted.features.vertexPipelineStoresAndAtomics =
            available.features.vertexPipelineStoresAndAtomics;
    }
    VkDeviceCreateInfo info{.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO,
                            .pNext = &wanted,
                            .queueCreateInfoCount = 1,
                            .pQueueCreateInfos = &queue};
    std::vector<const char*> extensions;
    // A driver of a part of Vulkan wants to be told that this is known.
    if (const char* const subset = "VK_KHR_portability_subset";
        instance_->has_extension(physical_, subset))
        extensions.push_back(subset);
    if (info_.features.external_memory) extensions.push_back(kExternalMemoryExtension);
    info.enabledExtensionCount = static_cast<std::uint32_t>(extensions.size());
    info.ppEnabledExtensionNames = extensions.data();
    const VkResult result = SPLAT_FAULT("vk.create_device")
                                ? VK_ERROR_OUT_OF_DEVICE_MEMORY
                                : instance_->create_device(physical_, &info, nullptr, &device_);
    if (result < VK_SUCCESS && !can_start_thread()) return no_thread("vkCreateDevice");
    SPLAT_TRY(check(result, "vkCreateDevice"));
    SPLAT_TRY(instance_->load(vk, device_));
    if (instance_->validation()) add_validated(*this);
    vk.vkGetDeviceQueue(device_, info_.queue_family, 0, &queue_);
    instance_->get_memory_properties(physical_, &memory_);
    return {};
}

Status Device::check_storage_buffers(const char* shader, std::uint32_t needed) const {
    if (needed <= info_.limits.max_storage_buffers) return {};
    return unsupported("shader %s needs %u storage buffers, but device %u (%s) has %u for a shader",
                       shader, needed, info_.index, info_.name.c_str(),
                       info_.limits.max_storage_buffers);
}

Status Device::check(VkResult result, const char* call) {
    if (result >= VK_SUCCESS) return {};
    if (result == VK_ERROR_DEVICE_LOST) lost_.store(true, std::memory_order_relaxed);
    switch (result) {
        case VK_ERROR_OUT_OF_HOST_MEMORY:
            return error(Code::kOutOfHostMemory, "%s: the driver found no host memory", call);
        case VK_ERROR_OUT_OF_DEVICE_MEMORY:
        case VK_ERROR_OUT_OF_POOL_MEMORY:
        case VK_ERROR_FRAGMENTED_POOL:
        case VK_ERROR_FRAGMENTATION:
        case VK_ERROR_TOO_MANY_OBJECTS:
        case VK_ERROR_MEMORY_MAP_FAILED:
            return error(Code::kOutOfDeviceMemory,
                         "%s failed with %s: free tensors or use smaller ones", call,
                         result_name(result));
        case VK_ERROR_DEVICE_LOST:
            return error(Code::kDeviceLost,
                         "%s: device %u (%s) was lost; destroy it and create it again", call,
                         info_.index, info_.name.c_str());
        case VK_ERROR_INVALID_EXTERNAL_HANDLE:
            return invalid(
                "%s failed with %s: the handle is none of memory that device %u (%s) opens, or "
                "its memory has another size",
                call, result_name(result), info_.index, info_.name.c_str());
        case VK_ERROR_FEATURE_NOT_PRESENT:
        case VK_ERROR_EXTENSION_NOT_PRESENT:
            return unsupported("%s failed with %s on device %u (%s)", call, result_name(result),
                               info_.index, info_.name.c_str());
        default:
            return error(Code::kInternal, "%s failed with %s (%d) on device %u (%s)%s", call,
                         result_name(result), static_cast<int>(result), info_.index,
                         info_.name.c_str(),
                         std::string_view(call).starts_with("vkCreateComputePipelines")
                             ? ": its compiler refuses a kernel; update the driver, use plain "
                               "kernels (SPLAT_KERNELS=plain), or choose another device"
                             : "");
    }
}

Status Device::alive() const {
    if (!lost_.load(std::memory_order_relaxed)) return {};
    return error(Code::kDeviceLost,
                 "device %u (%s) was lost in an earlier call; destroy it and create it again",
                 info_.index, info_.name.c_str());
}

Device::~Device() {
    if (device_ == VK_NULL_HANDLE || vk.vkDestroyDevice == nullptr) return;
    if (instance_->validation()) remove_validated(*this);
    for (const CommandBuffer& commands : spare) {
        vk.vkDestroyFence(device_, commands.fence, nullptr);
        vk.vkDestroyCommandPool(device_, commands.pool, nullptr);
    }
    if (!adopted_) vk.vkDestroyDevice(device_, nullptr);
}

void Device::end_at_exit() noexcept {
    lost_.store(true, std::memory_order_relaxed);
    vk.vkDeviceWaitIdle(device_);
    vk.vkDestroyDevice(device_, nullptr);
    device_ = VK_NULL_HANDLE;
}

}  // namespace splat::vk

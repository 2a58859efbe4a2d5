#include "vk/device_exit.h"

#include <atomic>
#include <cstdlib>
#include <mutex>
#include <type_traits>
#include <vector>

#include "core/fork.h"
#include "vk/device.h"

namespace splat::vk {
namespace {

/// Never destroyed, because devices may live until the end of the process.
struct Validated {
    ForkMutex mutex;
    std::vector<Device*> devices;
};
Validated& validated();

/// They are the parent's.
void forget_devices() {
    validated().devices.clear();
}

Validated& validated() {
    return for_ever<Validated, forget_devices>();
}

std::atomic<bool> g_ended{false};

template <typename Returned, typename... Arguments>
VKAPI_ATTR Returned VKAPI_CALL ended(Arguments...) {
    if constexpr (!std::is_void_v<Returned>) return VK_ERROR_DEVICE_LOST;
}

template <typename Returned, typename... Arguments>
void disable(Returned(VKAPI_PTR*& entry)(Arguments...)) {
    entry = ended<Returned, Arguments...>;
}

/// All that destructors call, and the first call of each other work: global objects of the program may be destroyed
/// later, and threads may run on.
void disable(VolkDeviceTable& vk) {
    const auto all = [](auto&... entries) { (disable(entries), ...); };
    all(vk.vkDestroyBuffer, vk.vkDestroyBufferView, vk.vkDestroyCommandPool,
        vk.vkDestroyDescriptorPool, vk.vkDestroyDescriptorSetLayout, vk.vkDestroyDevice,
        vk.vkDestroyFence, vk.vkDestroyPipeline, vk.vkDestroyPipelineCache,
        vk.vkDestroyPipelineLayout, vk.vkDestroyQueryPool, vk.vkDestroyShaderModule,
        vk.vkFreeMemory, vk.vkGetPipelineCacheData, vk.vkDeviceWaitIdle, vk.vkQueueWaitIdle);
    all(vk.vkAllocateCommandBuffers, vk.vkAllocateDescriptorSets, vk.vkAllocateMemory,
        vk.vkBeginCommandBuffer, vk.vkCreateBuffer, vk.vkCreateBufferView, vk.vkCreateCommandPool,
        vk.vkCreateComputePipelines, vk.vkCreateDescriptorPool, vk.vkCreateDescriptorSetLayout,
        vk.vkCreateFence, vk.vkCreatePipelineCache, vk.vkCreatePipelineLayout, vk.vkCreateQueryPool,
        vk.vkCreateShaderModule, vk.vkEndCommandBuffer, vk.vkFlushMappedMemoryRanges,
        vk.vkGetQueryPoolResults, vk.vkInvalidateMappedMemoryRanges, vk.vkMapMemory,
        vk.vkQueueSubmit, vk.vkResetFences, vk.vkWaitForFences);
}

void end_devices() {
    const std::lock_guard lock(validated().mutex);
    g_ended.store(true);
    for (Device* device : validated().devices) {
        device->end_at_exit();
        disable(device->vk);
    }
    validated().devices.clear();
}

}  // namespace

void end_devices_before(std::uint32_t layer_version) {
    if (layer_version >= VK_MAKE_API_VERSION(0, 1, 4, 305)) std::atexit(end_devices);
}

void add_validated(Device& device) {
    const std::lock_guard lock(validated().mutex);
    validated().devices.push_back(&device);
}

void remove_validated(const Device& device) noexcept {
    const std::lock_guard lock(validated().mutex);
    std::erase(validated().devices, &device);
}

bool devices_ended_at_exit() noexcept {
    return g_ended.load();
}

}  // namespace splat::vk

#define VOLK_IMPLEMENTATION
#include "bench/dispatch/raw_vulkan.h"

#include <algorithm>
#include <cstring>

#include "vkrun/cli/failure.h"
#include "vkrun/cli/stopwatch.h"
#include "vkrun/cli/text.h"

namespace vkrun::bench {
namespace {

void must(VkResult result, const char* call) {
    if (result < 0) throw Failure(kFailed, format("%s gave VkResult %d", call, result));
}

template <class T>
T info(VkStructureType type) {
    T value{};
    value.sType = type;
    return value;
}

constexpr std::uint32_t kPushBytes = 12;
constexpr std::uint32_t kMostPipelines = 16;

}  // namespace

void RawPipeline::bind(VkCommandBuffer to, std::array<std::uint32_t, 3> push) const {
    vkCmdBindPipeline(to, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline);
    vkCmdBindDescriptorSets(to, VK_PIPELINE_BIND_POINT_COMPUTE, layout, 0, 1, &set, 0, nullptr);
    vkCmdPushConstants(to, layout, VK_SHADER_STAGE_COMPUTE_BIT, 0, kPushBytes, push.data());
}

RawVulkan::RawVulkan(std::span<const std::uint8_t, 16> uuid) {
    must(volkInitialize(), "loading Vulkan");
    auto application = info<VkApplicationInfo>(VK_STRUCTURE_TYPE_APPLICATION_INFO);
    application.apiVersion = VK_API_VERSION_1_2;
    auto create = info<VkInstanceCreateInfo>(VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO);
    create.pApplicationInfo = &application;
    must(vkCreateInstance(&create, nullptr, &instance_), "vkCreateInstance");
    volkLoadInstance(instance_);
    find_device(uuid);
    describe();
    open_device();
}

RawVulkan::~RawVulkan() {
    if (device_ != VK_NULL_HANDLE) {
        vkDeviceWaitIdle(device_);
        for (const RawPipeline& one : pipelines_) {
            vkDestroyPipeline(device_, one.pipeline, nullptr);
            vkDestroyPipelineLayout(device_, one.layout, nullptr);
        }
        for (VkDescriptorSetLayout layout : set_layouts_)
            vkDestroyDescriptorSetLayout(device_, layout, nullptr);
        for (VkShaderModule module : modules_) vkDestroyShaderModule(device_, module, nullptr);
        for (RawBuffer& buffer : buffers_) {
            vkDestroyBuffer(device_, buffer.buffer, nullptr);
            vkFreeMemory(device_, buffer.memory, nullptr);
        }
        vkDestroyDescriptorPool(device_, descriptors_, nullptr);
        vkDestroyQueryPool(device_, queries_, nullptr);
        vkDestroyFence(device_, fence_, nullptr);
        vkDestroyCommandPool(device_, pool_, nullptr);
        vkDestroyDevice(device_, nullptr);
    }
    vkDestroyInstance(instance_, nullptr);
}

void RawVulkan::find_device(std::span<const std::uint8_t, 16> uuid) {
    std::uint32_t count = 0;
    must(vkEnumeratePhysicalDevices(instance_, &count, nullptr), "vkEnumeratePhysicalDevices");
    std::vector<VkPhysicalDevice> devices(count);
    must(vkEnumeratePhysicalDevices(instance_, &count, devices.data()),
         "vkEnumeratePhysicalDevices");
    for (VkPhysicalDevice device : devices) {
        auto id =
            info<VkPhysicalDeviceIDProperties>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ID_PROPERTIES);
        auto sizes = info<VkPhysicalDeviceSubgroupSizeControlProperties>(
            VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_SIZE_CONTROL_PROPERTIES);
        id.pNext = &sizes;
        auto all =
            info<VkPhysicalDeviceProperties2>(VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2);
        all.pNext = &id;
        vkGetPhysicalDeviceProperties2(device, &all);
        if (!std::equal(uuid.begin(), uuid.end(), id.deviceUUID)) continue;
        physical_ = device;
        properties_ = all.properties;
        lanes_ = {sizes.minSubgroupSize, sizes.maxSubgroupSize};
        return;
    }
    throw Failure(kNoDevice, "the Vulkan loader no longer lists the device that libsplat opened");
}

void RawVulkan::describe() {
    vkGetPhysicalDeviceMemoryProperties(physical_, &memory_);
    std::uint32_t count = 0;
    must(vkEnumerateDeviceExtensionProperties(physical_, nullptr, &count, nullptr),
         "vkEnumerateDeviceExtensionProperties");
    std::vector<VkExtensionProperties> found(count);
    must(vkEnumerateDeviceExtensionProperties(physical_, nullptr, &count, found.data()),
         "vkEnumerateDeviceExtensionProperties");
    for (const VkExtensionProperties& one : found) extensions_.emplace_back(one.extensionName);
    std::sort(extensions_.begin(), extensions_.end());
    vkGetPhysicalDeviceQueueFamilyProperties(physical_, &count, nullptr);
    std::vector<VkQueueFamilyProperties> families(count);
    vkGetPhysicalDeviceQueueFamilyProperties(physical_, &count, families.data());
    const auto family =
        std::find_if(families.begin(), families.end(), [](const VkQueueFamilyProperties& one) {
            return (one.queueFlags & VK_QUEUE_COMPUTE_BIT) != 0;
        });
    if (family == families.end()) throw Failure(kNoDevice, "the device has no compute queue");
    family_ = static_cast<std::uint32_t>(family - families.begin());
    timestamp_bits_ = family->timestampValidBits;
}

void RawVulkan::open_device() {
    const float priority = 1;
    auto queue = info<VkDeviceQueueCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO);
    queue.queueFamilyIndex = family_;
    queue.queueCount = 1;
    queue.pQueuePriorities = &priority;
    auto create = info<VkDeviceCreateInfo>(VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO);
    create.queueCreateInfoCount = 1;
    create.pQueueCreateInfos = &queue;
    must(vkCreateDevice(physical_, &create, nullptr, &device_), "vkCreateDevice");
    volkLoadDevice(device_);
    vkGetDeviceQueue(device_, family_, 0, &queue_);
    auto pool = info<VkCommandPoolCreateInfo>(VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO);
    pool.queueFamilyIndex = family_;
    pool.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
    must(vkCreateCommandPool(device_, &pool, nullptr, &pool_), "vkCreateCommandPool");
    auto commands =
        info<VkCommandBufferAllocateInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO);
    commands.commandPool = pool_;
    commands.commandBufferCount = 1;
    must(vkAllocateCommandBuffers(device_, &commands, &commands_), "vkAllocateCommandBuffers");
    const auto fence = info<VkFenceCreateInfo>(VK_STRUCTURE_TYPE_FENCE_CREATE_INFO);
    must(vkCreateFence(device_, &fence, nullptr, &fence_), "vkCreateFence");
    auto queries = info<VkQueryPoolCreateInfo>(VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO);
    queries.queryType = VK_QUERY_TYPE_TIMESTAMP;
    queries.queryCount = 2;
    must(vkCreateQueryPool(device_, &queries, nullptr, &queries_), "vkCreateQueryPool");
    const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 2 * kMostPipelines};
    auto sets = info<VkDescriptorPoolCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO);
    sets.maxSets = kMostPipelines;
    sets.poolSizeCount = 1;
    sets.pPoolSizes = &size;
    must(vkCreateDescriptorPool(device_, &sets, nullptr, &descriptors_), "vkCreateDescriptorPool");
}

std::optional<std::uint32_t> RawVulkan::memory_type(std::uint32_t allowed,
                                                    VkMemoryPropertyFlags wanted,
                                                    VkMemoryPropertyFlags unwanted) const {
    for (std::uint32_t i = 0; i < memory_.memoryTypeCount; ++i) {
        const VkMemoryPropertyFlags flags = memory_.memoryTypes[i].propertyFlags;
        if ((allowed >> i & 1U) != 0 && (flags & wanted) == wanted && (flags & unwanted) == 0)
            return i;
    }
    return std::nullopt;
}

std::optional<RawBuffer> RawVulkan::buffer(VkDeviceSize bytes, VkMemoryPropertyFlags wanted,
                                           VkMemoryPropertyFlags unwanted) {
    auto create = info<VkBufferCreateInfo>(VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO);
    create.size = bytes;
    create.usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT |
                   VK_BUFFER_USAGE_TRANSFER_DST_BIT;
    RawBuffer made{.bytes = bytes};
    must(vkCreateBuffer(device_, &create, nullptr, &made.buffer), "vkCreateBuffer");
    VkMemoryRequirements needs;
    vkGetBufferMemoryRequirements(device_, made.buffer, &needs);
    const auto type = memory_type(needs.memoryTypeBits, wanted, unwanted);
    if (type) {
        auto allocate = info<VkMemoryAllocateInfo>(VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO);
        allocate.allocationSize = needs.size;
        allocate.memoryTypeIndex = *type;
        if (vkAllocateMemory(device_, &allocate, nullptr, &made.memory) != VK_SUCCESS)
            made.memory = VK_NULL_HANDLE;
    }
    if (made.memory == VK_NULL_HANDLE) {
        vkDestroyBuffer(device_, made.buffer, nullptr);
        return std::nullopt;
    }
    buffers_.push_back(made);
    must(vkBindBufferMemory(device_, made.buffer, made.memory, 0), "vkBindBufferMemory");
    return made;
}

void RawVulkan::free(RawBuffer& buffer) {
    std::erase_if(buffers_, [&](const RawBuffer& one) { return one.buffer == buffer.buffer; });
    vkDestroyBuffer(device_, buffer.buffer, nullptr);
    vkFreeMemory(device_, buffer.memory, nullptr);
    buffer = {};
}

void* RawVulkan::map(const RawBuffer& buffer) {
    void* data = nullptr;
    must(vkMapMemory(device_, buffer.memory, 0, VK_WHOLE_SIZE, 0, &data), "vkMapMemory");
    return data;
}

void RawVulkan::invalidate(const RawBuffer& buffer) {
    auto range = info<VkMappedMemoryRange>(VK_STRUCTURE_TYPE_MAPPED_MEMORY_RANGE);
    range.memory = buffer.memory;
    range.size = VK_WHOLE_SIZE;
    must(vkInvalidateMappedMemoryRanges(device_, 1, &range), "vkInvalidateMappedMemoryRanges");
}

RawPipeline RawVulkan::pipeline(std::span<const std::uint32_t> spirv,
                                const std::vector<RawBuffer>& buffers, std::uint32_t constant) {
    auto code = info<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
    code.codeSize = spirv.size_bytes();
    code.pCode = spirv.data();
    must(vkCreateShaderModule(device_, &code, nullptr, &modules_.emplace_back()),
         "vkCreateShaderModule");
    std::vector<VkDescriptorSetLayoutBinding> bindings(buffers.size());
    for (std::uint32_t i = 0; i < bindings.size(); ++i)
        bindings[i] = {i, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT,
                       nullptr};
    auto sets =
        info<VkDescriptorSetLayoutCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO);
    sets.bindingCount = static_cast<std::uint32_t>(bindings.size());
    sets.pBindings = bindings.data();
    must(vkCreateDescriptorSetLayout(device_, &sets, nullptr, &set_layouts_.emplace_back()),
         "vkCreateDescriptorSetLayout");
    const VkPushConstantRange push{VK_SHADER_STAGE_COMPUTE_BIT, 0, kPushBytes};
    auto layout = info<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
    layout.setLayoutCount = 1;
    layout.pSetLayouts = &set_layouts_.back();
    layout.pushConstantRangeCount = 1;
    layout.pPushConstantRanges = &push;
    RawPipeline& made = pipelines_.emplace_back();
    must(vkCreatePipelineLayout(device_, &layout, nullptr, &made.layout), "vkCreatePipelineLayout");
    const VkSpecializationMapEntry entry{0, 0, sizeof constant};
    const VkSpecializationInfo constants{1, &entry, sizeof constant, &constant};
    auto create = info<VkComputePipelineCreateInfo>(VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO);
    create.layout = made.layout;
    create.stage =
        info<VkPipelineShaderStageCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO);
    create.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
    create.stage.module = modules_.back();
    create.stage.pName = "main";
    create.stage.pSpecializationInfo = &constants;
    must(vkCreateComputePipelines(device_, VK_NULL_HANDLE, 1, &create, nullptr, &made.pipeline),
         "vkCreateComputePipelines");
    auto allocate =
        info<VkDescriptorSetAllocateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO);
    allocate.descriptorPool = descriptors_;
    allocate.descriptorSetCount = 1;
    allocate.pSetLayouts = &set_layouts_.back();
    must(vkAllocateDescriptorSets(device_, &allocate, &made.set), "vkAllocateDescriptorSets");
    for (std::uint32_t i = 0; i < buffers.size(); ++i) {
        const VkDescriptorBufferInfo range{buffers[i].buffer, 0, VK_WHOLE_SIZE};
        auto write = info<VkWriteDescriptorSet>(VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET);
        write.dstSet = made.set;
        write.dstBinding = i;
        write.descriptorCount = 1;
        write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
        write.pBufferInfo = &range;
        vkUpdateDescriptorSets(device_, 1, &write, 0, nullptr);
    }
    return made;
}

RunTimes RawVulkan::run(const std::function<void(VkCommandBuffer)>& record) {
    RunTimes times;
    times.record_ms = timed_ms([&] {
        const auto begin =
            info<VkCommandBufferBeginInfo>(VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO);
        must(vkBeginCommandBuffer(commands_, &begin), "vkBeginCommandBuffer");
        const bool timed = timestamp_bits_ > 0;
        if (timed) {
            vkCmdResetQueryPool(commands_, queries_, 0, 2);
            vkCmdWriteTimestamp(commands_, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, queries_, 0);
        }
        record(commands_);
        if (timed) vkCmdWriteTimestamp(commands_, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, queries_, 1);
        must(vkEndCommandBuffer(commands_), "vkEndCommandBuffer");
    });
    times.wall_ms = submit(true);
    if (timestamp_bits_ == 0) return times;
    std::uint64_t ticks[2] = {};
    must(vkGetQueryPoolResults(device_, queries_, 0, 2, sizeof ticks, ticks, sizeof ticks[0],
                               VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT),
         "vkGetQueryPoolResults");
    const std::uint64_t mask = timestamp_bits_ == 64 ? ~0ULL : (1ULL << timestamp_bits_) - 1;
    times.device_ms = static_cast<double>((ticks[1] - ticks[0]) & mask) *
                      static_cast<double>(properties_.limits.timestampPeriod) * 1e-6;
    return times;
}

double RawVulkan::submit(bool with_commands) {
    auto submit = info<VkSubmitInfo>(VK_STRUCTURE_TYPE_SUBMIT_INFO);
    submit.commandBufferCount = with_commands ? 1 : 0;
    submit.pCommandBuffers = &commands_;
    must(vkResetFences(device_, 1, &fence_), "vkResetFences");
    constexpr std::uint64_t kMinuteNs = 60'000'000'000;
    return timed_ms([&] {
        must(vkQueueSubmit(queue_, 1, &submit, fence_), "vkQueueSubmit");
        const VkResult waited = vkWaitForFences(device_, 1, &fence_, VK_TRUE, kMinuteNs);
        if (waited == VK_TIMEOUT) throw Failure(kFailed, "the device did not finish within 60 s");
        must(waited, "vkWaitForFences");
    });
}

}  // namespace vkrun::bench

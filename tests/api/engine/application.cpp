#include "api/engine/application.h"

#include <algorithm>
#include <bit>
#include <cstdio>
#include <cstdlib>

#include "support/require_vulkan.h"

namespace splat::test {
namespace {

constexpr const char* kLayer = "VK_LAYER_KHRONOS_validation";

void must(VkResult result, const char* call) {
    if (result == VK_SUCCESS) return;
    std::fprintf(stderr, "%s: VkResult %d\n", call, static_cast<int>(result));
    std::abort();
}
#define MUST(call) must(call, #call)

/// Sanitizers run without the layer, as other tests do, and Wine's Vulkan lists none.
bool validates() {
    static const bool wanted = environment("SPLAT_TEST_VALIDATION").value_or("1") != "0";
    if (!wanted) return false;
    static const bool found = [] {
        std::uint32_t count = 0;
        MUST(vkEnumerateInstanceLayerProperties(&count, nullptr));
        std::vector<VkLayerProperties> layers(count);
        MUST(vkEnumerateInstanceLayerProperties(&count, layers.data()));
        const bool listed = std::ranges::any_of(layers, [](const VkLayerProperties& layer) {
            return std::strcmp(layer.layerName, kLayer) == 0;
        });
        std::printf("[ layers   ] validation is %s\n", listed ? "on" : "OFF: no layer is listed");
        return listed;
    }();
#if !defined(_WIN32)
    EXPECT_TRUE(found || !vulkan_required()) << kLayer << " is not installed";
#endif
    return found;
}

VKAPI_ATTR VkBool32 VKAPI_CALL on_message(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                          VkDebugUtilsMessageTypeFlagsEXT,
                                          const VkDebugUtilsMessengerCallbackDataEXT* data,
                                          void* user) {
    ++static_cast<Application*>(user)->messages;
    std::fprintf(stderr, "[validation] %s\n", data->pMessage);
    return VK_FALSE;
}

void lock(void* user) {
    auto& app = *static_cast<Application*>(user);
    app.queue_mutex.lock();
    if (app.locks++ != app.unlocks) ++app.nested;
}

void unlock(void* user) {
    auto& app = *static_cast<Application*>(user);
    ++app.unlocks;
    app.queue_mutex.unlock();
}

}  // namespace

Application::Application(const ApplicationDesc& desc) : api_version_(desc.api_version) {
    MUST(volkInitialize());
    make_instance(desc.api_version);
    std::uint32_t count = 1;
    if (vkEnumeratePhysicalDevices(instance, &count, &physical) < VK_SUCCESS || count == 0)
        std::abort();
    make_device(desc);
}

void Application::make_instance(std::uint32_t api_version) {
    const VkApplicationInfo app{.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO,
                                .pNext = nullptr,
                                .pApplicationName = "test",
                                .applicationVersion = 0,
                                .pEngineName = "test",
                                .engineVersion = 0,
                                .apiVersion = api_version};
    const VkValidationFeatureEnableEXT sync =
        VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT;
    VkValidationFeaturesEXT checks{};
    checks.sType = VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT;
    checks.enabledValidationFeatureCount = 1;
    checks.pEnabledValidationFeatures = &sync;
    VkDebugUtilsMessengerCreateInfoEXT messenger{};
    messenger.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT;
    messenger.pNext = &checks;
    messenger.messageSeverity = VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT |
                                VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
    messenger.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT;
    messenger.pfnUserCallback = on_message;
    messenger.pUserData = this;
    const char* const extension = VK_EXT_DEBUG_UTILS_EXTENSION_NAME;
    VkInstanceCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
    info.pApplicationInfo = &app;
    if (validates()) {
        info.pNext = &messenger;
        info.enabledLayerCount = 1;
        info.ppEnabledLayerNames = &kLayer;
        info.enabledExtensionCount = 1;
        info.ppEnabledExtensionNames = &extension;
    }
    MUST(vkCreateInstance(&info, nullptr, &instance));
    volkLoadInstance(instance);
    messenger.pNext = nullptr;
    if (validates())
        MUST(vkCreateDebugUtilsMessengerEXT(instance, &messenger, nullptr, &messenger_));
}

splat_vulkan_requirements Application::requirements() {
    auto needs = sized<splat_vulkan_requirements>();
    needs.get_instance_proc_addr = reinterpret_cast<splat_vulkan_function>(vkGetInstanceProcAddr);
    needs.instance = instance;
    needs.physical_device = physical;
    needs.features = &features_;
    return needs;
}

void Application::make_device(const ApplicationDesc& desc) {
    v12_.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES;
    features_.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2;
    features_.pNext = &v12_;
    splat_vulkan_requirements needs = requirements();
    EXPECT_DONE(splat_device_requirements(&needs));
    EXPECT_EQ(v12_.timelineSemaphore, VK_TRUE);
    if (!desc.timeline) v12_.timelineSemaphore = VK_FALSE;
    if (!desc.int64) features_.features.shaderInt64 = VK_FALSE;
    family = needs.queue_family;
    const float priority = 1;
    VkDeviceQueueCreateInfo queues{};
    queues.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO;
    queues.queueFamilyIndex = family;
    queues.queueCount = 1;
    queues.pQueuePriorities = &priority;
    VkDeviceCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
    // An instance of an earlier version may not name the structs of this one.
    if (desc.api_version >= VK_API_VERSION_1_2) info.pNext = &features_;
    info.queueCreateInfoCount = 1;
    info.pQueueCreateInfos = &queues;
    info.enabledExtensionCount = needs.extension_count;
    info.ppEnabledExtensionNames = needs.extensions;
    MUST(vkCreateDevice(physical, &info, nullptr, &device));
    volkLoadDevice(device);
    vkGetDeviceQueue(device, family, 0, &queue);
    VkCommandPoolCreateInfo pool{};
    pool.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
    pool.queueFamilyIndex = family;
    MUST(vkCreateCommandPool(device, &pool, nullptr, &pool_));
}

Application::~Application() {
    idle();
    vkDestroyCommandPool(device, pool_, nullptr);
    for (const VkImage image : images_) vkDestroyImage(device, image, nullptr);
    for (const VkBuffer buffer : buffers_) vkDestroyBuffer(device, buffer, nullptr);
    for (const VkSemaphore semaphore : semaphores_) vkDestroySemaphore(device, semaphore, nullptr);
    for (const VkDeviceMemory memory : memories_) vkFreeMemory(device, memory, nullptr);
    vkDestroyDevice(device, nullptr);
    if (messenger_ != VK_NULL_HANDLE)
        vkDestroyDebugUtilsMessengerEXT(instance, messenger_, nullptr);
    vkDestroyInstance(instance, nullptr);
    EXPECT_EQ(messages.load(), 0) << "messages of the validation layer, see above";
    EXPECT_EQ(locks.load(), unlocks.load());
    EXPECT_EQ(nested.load(), 0);
}

splat_vulkan_desc Application::desc() {
    auto desc = sized<splat_vulkan_desc>();
    desc.get_instance_proc_addr = reinterpret_cast<splat_vulkan_function>(vkGetInstanceProcAddr);
    desc.instance = instance;
    desc.physical_device = physical;
    desc.device = device;
    desc.queue = queue;
    desc.queue_family = family;
    desc.api_version = api_version_;
    desc.features = &features_;
    desc.lock_queue = lock;
    desc.unlock_queue = unlock;
    desc.user = this;
    return desc;
}

Device Application::open() {
    const splat_vulkan_desc given = desc();
    splat_device_desc more = device_desc();
    Device opened;
    EXPECT_DONE(splat_device_from_vulkan(&given, &more, opened.out()));
    return opened;
}

VkDeviceMemory Application::allocate(const VkMemoryRequirements& needs,
                                     VkMemoryPropertyFlags flags) {
    VkPhysicalDeviceMemoryProperties types;
    vkGetPhysicalDeviceMemoryProperties(physical, &types);
    VkMemoryAllocateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
    info.allocationSize = needs.size;
    while ((needs.memoryTypeBits >> info.memoryTypeIndex & 1U) == 0 ||
           (types.memoryTypes[info.memoryTypeIndex].propertyFlags & flags) != flags)
        ++info.memoryTypeIndex;
    VkDeviceMemory memory = VK_NULL_HANDLE;
    MUST(vkAllocateMemory(device, &info, nullptr, &memory));
    memories_.push_back(memory);
    return memory;
}

VkImage Application::make_image(std::uint32_t width, std::uint32_t height, VkFormat format) {
    VkImageCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO;
    info.imageType = VK_IMAGE_TYPE_2D;
    info.format = format;
    info.extent = {width, height, 1};
    info.mipLevels = info.arrayLayers = 1;
    info.samples = VK_SAMPLE_COUNT_1_BIT;
    info.usage = VK_IMAGE_USAGE_TRANSFER_DST_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT;
    VkImage image = VK_NULL_HANDLE;
    MUST(vkCreateImage(device, &info, nullptr, &image));
    images_.push_back(image);
    VkMemoryRequirements needs;
    vkGetImageMemoryRequirements(device, image, &needs);
    MUST(vkBindImageMemory(device, image, allocate(needs, 0), 0));
    return image;
}

VkBuffer Application::make_buffer(std::uint64_t bytes, std::byte** host) {
    VkBufferCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
    info.size = bytes;
    info.usage = VK_BUFFER_USAGE_TRANSFER_DST_BIT;
    VkBuffer buffer = VK_NULL_HANDLE;
    MUST(vkCreateBuffer(device, &info, nullptr, &buffer));
    buffers_.push_back(buffer);
    VkMemoryRequirements needs;
    vkGetBufferMemoryRequirements(device, buffer, &needs);
    const VkDeviceMemory memory =
        allocate(needs, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT);
    MUST(vkBindBufferMemory(device, buffer, memory, 0));
    void* mapped = nullptr;
    MUST(vkMapMemory(device, memory, 0, VK_WHOLE_SIZE, 0, &mapped));
    *host = static_cast<std::byte*>(mapped);
    return buffer;
}

VkSemaphore Application::make_timeline() {
    VkSemaphoreTypeCreateInfo type{};
    type.sType = VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO;
    type.semaphoreType = VK_SEMAPHORE_TYPE_TIMELINE;
    VkSemaphoreCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO;
    info.pNext = &type;
    VkSemaphore semaphore = VK_NULL_HANDLE;
    MUST(vkCreateSemaphore(device, &info, nullptr, &semaphore));
    semaphores_.push_back(semaphore);
    return semaphore;
}

const std::byte* Application::copy(VkImage image, const splat_vulkan_target& target,
                                   const splat_vulkan_frame& frame, std::uint32_t width,
                                   std::uint32_t height) {
    std::byte* host = nullptr;
    const VkBuffer buffer = make_buffer(std::uint64_t{4} * width * height, &host);
    VkCommandBufferAllocateInfo allocate{};
    allocate.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
    allocate.commandPool = pool_;
    allocate.commandBufferCount = 1;
    VkCommandBuffer commands = VK_NULL_HANDLE;
    MUST(vkAllocateCommandBuffers(device, &allocate, &commands));
    VkCommandBufferBeginInfo begin{};
    begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
    MUST(vkBeginCommandBuffer(commands, &begin));
    VkBufferImageCopy region{};
    region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
    region.imageExtent = {width, height, 1};
    vkCmdCopyImageToBuffer(commands, image, static_cast<VkImageLayout>(target.layout), buffer, 1,
                           &region);
    MUST(vkEndCommandBuffer(commands));
    const auto semaphore = std::bit_cast<VkSemaphore>(frame.semaphore);
    const VkPipelineStageFlags stage = VK_PIPELINE_STAGE_TRANSFER_BIT;
    VkTimelineSemaphoreSubmitInfo values{};
    values.sType = VK_STRUCTURE_TYPE_TIMELINE_SEMAPHORE_SUBMIT_INFO;
    values.waitSemaphoreValueCount = 1;
    values.pWaitSemaphoreValues = &frame.value;
    VkSubmitInfo submit{};
    submit.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
    submit.pNext = &values;
    submit.waitSemaphoreCount = 1;
    submit.pWaitSemaphores = &semaphore;
    submit.pWaitDstStageMask = &stage;
    submit.commandBufferCount = 1;
    submit.pCommandBuffers = &commands;
    const std::lock_guard lock(queue_mutex);
    MUST(vkQueueSubmit(queue, 1, &submit, VK_NULL_HANDLE));
    return host;
}

void Application::submit_nothing() {
    const std::lock_guard lock(queue_mutex);
    MUST(vkQueueSubmit(queue, 0, nullptr, VK_NULL_HANDLE));
}

void Application::idle() {
    const std::lock_guard lock(queue_mutex);
    MUST(vkQueueWaitIdle(queue));
}

void Application::wait(const splat_vulkan_frame& frame) const {
    const auto semaphore = std::bit_cast<VkSemaphore>(frame.semaphore);
    VkSemaphoreWaitInfo info{};
    info.sType = VK_STRUCTURE_TYPE_SEMAPHORE_WAIT_INFO;
    info.semaphoreCount = 1;
    info.pSemaphores = &semaphore;
    info.pValues = &frame.value;
    MUST(vkWaitSemaphores(device, &info, ~std::uint64_t{0}));
}

}  // namespace splat::test

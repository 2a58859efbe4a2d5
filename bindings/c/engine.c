/* A turn around a scene, drawn into an image of this program's own Vulkan device. The host waits for nothing between
 * the frames; each is copied by a submit of the program that waits on the device.
 *
 *   engine scene.ply view_     writes view_0.png to view_3.png
 *
 * cc -std=c11 engine.c $(pkg-config --cflags --libs splat vulkan) -lm -o engine */
#include <splat.h>
#include <stdio.h>
#include <stdlib.h>
#include <vulkan/vulkan.h>

enum { WIDTH = 320, HEIGHT = 240, FRAMES = 4, BYTES = WIDTH * HEIGHT * 4 };

static void fail(const char* call, const char* why) {
    fprintf(stderr, "%s: %s\n", call, why);
    exit(1);
}
#define VK(call) ((call) == VK_SUCCESS ? (void)0 : fail(#call, "failed"))
#define SPLAT(call) ((call) == SPLAT_OK ? (void)0 : fail(#call, splat_last_error_message()))

typedef struct Engine {
    VkInstance instance;
    VkPhysicalDevice physical;
    VkDevice device;
    VkQueue queue;
    VkImage image;
    VkBuffer buffer; /* all frames, for the host to read */
    VkDeviceMemory image_memory, buffer_memory;
    unsigned char* pixels; /* the buffer's */
    VkCommandPool pool;
    splat_device splat;
} Engine;

/* Make instance and device with what the library needs, and open the library's device on them. */
static void open_device(Engine* e) {
    const VkApplicationInfo app = {.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO, .apiVersion = VK_API_VERSION_1_2};
    const VkInstanceCreateInfo instance = {.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO, .pApplicationInfo = &app};
    VK(vkCreateInstance(&instance, NULL, &e->instance));
    uint32_t count = 1;
    if (vkEnumeratePhysicalDevices(e->instance, &count, &e->physical) < VK_SUCCESS || count == 0)
        fail("vkEnumeratePhysicalDevices", "no device; install a Vulkan driver");

    VkPhysicalDeviceVulkan12Features v12 = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES};
    VkPhysicalDeviceFeatures2 features = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, .pNext = &v12};
    splat_vulkan_requirements needs = {.struct_size = sizeof needs};
    needs.get_instance_proc_addr = (splat_vulkan_function)vkGetInstanceProcAddr;
    needs.instance = e->instance;
    needs.physical_device = e->physical;
    needs.features = &features;
    SPLAT(splat_device_requirements(&needs));

    const float priority = 1;
    const VkDeviceQueueCreateInfo queue = {
        .sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO, .queueFamilyIndex = needs.queue_family,
        .queueCount = 1, .pQueuePriorities = &priority};
    const VkDeviceCreateInfo device = {
        .sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO, .pNext = &features,
        .queueCreateInfoCount = 1, .pQueueCreateInfos = &queue,
        .enabledExtensionCount = needs.extension_count, .ppEnabledExtensionNames = needs.extensions};
    VK(vkCreateDevice(e->physical, &device, NULL, &e->device));
    vkGetDeviceQueue(e->device, needs.queue_family, 0, &e->queue);
    const VkCommandPoolCreateInfo pool = {.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO,
                                          .queueFamilyIndex = needs.queue_family};
    VK(vkCreateCommandPool(e->device, &pool, NULL, &e->pool));

    splat_vulkan_desc desc = {.struct_size = sizeof desc};
    desc.get_instance_proc_addr = needs.get_instance_proc_addr;
    desc.instance = e->instance;
    desc.physical_device = e->physical;
    desc.device = e->device;
    desc.queue = e->queue; /* this program has one thread, so that nothing locks the queue */
    desc.queue_family = needs.queue_family;
    desc.api_version = app.apiVersion;
    desc.extensions = needs.extensions;
    desc.extension_count = needs.extension_count;
    desc.features = &features;
    SPLAT(splat_device_from_vulkan(&desc, NULL, &e->splat));
}

static VkDeviceMemory allocate(const Engine* e, const VkMemoryRequirements* needs, VkMemoryPropertyFlags flags) {
    VkPhysicalDeviceMemoryProperties memory;
    vkGetPhysicalDeviceMemoryProperties(e->physical, &memory);
    VkMemoryAllocateInfo info = {.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, .allocationSize = needs->size};
    while (info.memoryTypeIndex < memory.memoryTypeCount &&
           ((needs->memoryTypeBits >> info.memoryTypeIndex & 1) == 0 ||
            (memory.memoryTypes[info.memoryTypeIndex].propertyFlags & flags) != flags))
        ++info.memoryTypeIndex;
    VkDeviceMemory made;
    VK(vkAllocateMemory(e->device, &info, NULL, &made));
    return made;
}

static void make_images(Engine* e) {
    const VkImageCreateInfo image = {
        .sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO, .imageType = VK_IMAGE_TYPE_2D,
        .format = VK_FORMAT_R8G8B8A8_UNORM, .extent = {WIDTH, HEIGHT, 1}, .mipLevels = 1, .arrayLayers = 1,
        .samples = VK_SAMPLE_COUNT_1_BIT, .usage = VK_IMAGE_USAGE_TRANSFER_DST_BIT | VK_IMAGE_USAGE_TRANSFER_SRC_BIT};
    const VkBufferCreateInfo buffer = {.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO,
        .size = (VkDeviceSize)FRAMES * BYTES, .usage = VK_BUFFER_USAGE_TRANSFER_DST_BIT};
    VkMemoryRequirements needs;
    VK(vkCreateImage(e->device, &image, NULL, &e->image));
    vkGetImageMemoryRequirements(e->device, e->image, &needs);
    e->image_memory = allocate(e, &needs, 0);
    VK(vkBindImageMemory(e->device, e->image, e->image_memory, 0));
    VK(vkCreateBuffer(e->device, &buffer, NULL, &e->buffer));
    vkGetBufferMemoryRequirements(e->device, e->buffer, &needs);
    e->buffer_memory =
        allocate(e, &needs, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT);
    VK(vkBindBufferMemory(e->device, e->buffer, e->buffer_memory, 0));
    void* pixels;
    VK(vkMapMemory(e->device, e->buffer_memory, 0, VK_WHOLE_SIZE, 0, &pixels));
    e->pixels = pixels;
}

/* Submit the copy of the image to a part of the buffer, once the library's frame is there. */
static void copy_frame(const Engine* e, uint32_t i, const splat_vulkan_frame* frame) {
    const VkCommandBufferAllocateInfo allocate_info = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO,
        .commandPool = e->pool, .commandBufferCount = 1};
    const VkCommandBufferBeginInfo begin = {.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
    const VkBufferImageCopy region = {.bufferOffset = (VkDeviceSize)i * BYTES,
        .imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1}, .imageExtent = {WIDTH, HEIGHT, 1}};
    const VkMemoryBarrier to_host = {.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER,
        .srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT, .dstAccessMask = VK_ACCESS_HOST_READ_BIT};
    VkCommandBuffer commands;
    VK(vkAllocateCommandBuffers(e->device, &allocate_info, &commands));
    VK(vkBeginCommandBuffer(commands, &begin));
    vkCmdCopyImageToBuffer(commands, e->image, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL, e->buffer, 1, &region);
    vkCmdPipelineBarrier(commands, VK_PIPELINE_STAGE_TRANSFER_BIT, VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &to_host, 0, NULL,
                         0, NULL);
    VK(vkEndCommandBuffer(commands));

    const VkSemaphore semaphore = (VkSemaphore)frame->semaphore;
    const VkPipelineStageFlags stage = VK_PIPELINE_STAGE_TRANSFER_BIT;
    const VkTimelineSemaphoreSubmitInfo values = {.sType = VK_STRUCTURE_TYPE_TIMELINE_SEMAPHORE_SUBMIT_INFO,
        .waitSemaphoreValueCount = 1, .pWaitSemaphoreValues = &frame->value};
    const VkSubmitInfo submit = {.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO, .pNext = &values,
        .waitSemaphoreCount = 1, .pWaitSemaphores = &semaphore, .pWaitDstStageMask = &stage,
        .commandBufferCount = 1, .pCommandBuffers = &commands};
    VK(vkQueueSubmit(e->queue, 1, &submit, VK_NULL_HANDLE));
}

static void close_all(Engine* e) {
    vkDestroyCommandPool(e->device, e->pool, NULL);
    vkDestroyBuffer(e->device, e->buffer, NULL);
    vkDestroyImage(e->device, e->image, NULL);
    vkFreeMemory(e->device, e->buffer_memory, NULL);
    vkFreeMemory(e->device, e->image_memory, NULL);
    vkDestroyDevice(e->device, NULL);
    vkDestroyInstance(e->instance, NULL);
}

int main(int argc, char** argv) {
    if (argc != 3) fail("usage", "engine scene.ply view_");
    Engine e = {0};
    splat_scene scene;
    splat_camera cameras[FRAMES];
    splat_rasterizer rasterizer;
    splat_scene_info info = {.struct_size = sizeof info};
    splat_orbit_desc orbit = {.struct_size = sizeof orbit, .width = WIDTH, .height = HEIGHT, .elevation = 0.3};
    SPLAT(splat_scene_load(argv[1], NULL, &scene));
    SPLAT(splat_scene_get_info(scene, &info));
    SPLAT(splat_camera_orbit(scene, &orbit, FRAMES, cameras));
    open_device(&e);
    make_images(&e);
    splat_rasterizer_desc desc = {.struct_size = sizeof desc, .flags = info.drawn_as,
        .gaussians = (uint32_t)info.count, .views = 1, .width = WIDTH, .height = HEIGHT, .sh_degree = info.sh_degree};
    SPLAT(splat_rasterizer_create(e.splat, &desc, &rasterizer));

    splat_vulkan_target target = {.struct_size = sizeof target};
    target.image = (uint64_t)e.image;
    target.format = VK_FORMAT_R8G8B8A8_UNORM;
    target.layout = VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL;
    unsigned waited = 0;
    for (uint32_t i = 0; i < FRAMES; ++i) {
        splat_vulkan_frame frame = {.struct_size = sizeof frame};
        SPLAT(splat_rasterizer_submit(rasterizer, NULL, scene, &cameras[i], NULL, &target, &frame));
        copy_frame(&e, i, &frame);
        waited += frame.waited;
        if (frame.lost != 0) fprintf(stderr, "frame %u needed more memory and shows less\n", (unsigned)frame.lost - 1);
    }
    VK(vkQueueWaitIdle(e.queue));
    printf("%d frames, %u of them waited for\n", FRAMES, waited);

    for (uint32_t i = 0; i < FRAMES; ++i) {
        char name[1024];
        const splat_image picture = {e.pixels + (size_t)i * BYTES, BYTES, SPLAT_PIXEL_U8, WIDTH, HEIGHT, 4, 0, 0, 0};
        snprintf(name, sizeof name, "%s%u.png", argv[2], (unsigned)i);
        SPLAT(splat_image_save(name, &picture));
    }
    /* The library's objects end before the device that they are on. */
    SPLAT(splat_rasterizer_destroy(rasterizer));
    SPLAT(splat_scene_destroy(scene));
    SPLAT(splat_device_destroy(e.splat));
    close_all(&e);
    return 0;
}

/* libsplat: on the Vulkan device of an application, which draws scenes into its images without waiting.
 *
 *   splat_vulkan_requirements needs = {.struct_size = sizeof needs, .features = features};
 *   needs.get_instance_proc_addr = (splat_vulkan_function)vkGetInstanceProcAddr;
 *   needs.instance = instance;
 *   needs.physical_device = physical;
 *   splat_device_requirements(&needs);                 // then vkCreateDevice, as they say
 *   splat_device_from_vulkan(&vulkan, NULL, &device);  // the same handles, with device and queue
 *   splat_rasterizer_create(device, &raster, &rasterizer);
 *   splat_rasterizer_submit(rasterizer, NULL, scene, &camera, NULL, &target, &frame);
 *   // then vkQueueSubmit of the application, which waits for frame.value of frame.semaphore
 *
 * Handles of Vulkan are void* where they are pointers on all platforms, else uint64_t; no header of Vulkan is
 * needed. The library owns nothing of the application's, and destroys its own objects: instance, device and
 * queue must live until splat_device_destroy has been called for the device, its rasterizers, tensors and
 * other objects are destroyed, and each scene that was drawn on it is changed or destroyed. */
#ifndef SPLAT_VULKAN_H
#define SPLAT_VULKAN_H

#include "render.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A function of Vulkan, of any type, as PFN_vkVoidFunction. */
typedef void (*splat_vulkan_function)(void);

/* Called to lock or unlock a queue, on the thread of a call of the library, in pairs and never nested.
 * It must not throw and not call the library. */
typedef void (*splat_queue_callback)(void* user);

/* What an application's device needs. */
typedef struct splat_vulkan_requirements {
    uint32_t struct_size;
    uint32_t queue_family; /* out: one that fits, without graphics if there is one */
    splat_vulkan_function get_instance_proc_addr; /* in: vkGetInstanceProcAddr */
    void* instance;                               /* in: VkInstance */
    void* physical_device;                        /* in: VkPhysicalDevice of the instance */
    /* in: VkPhysicalDeviceFeatures2 that the application will pass to vkCreateDevice, with
     * VkPhysicalDeviceVulkan12Features or VkPhysicalDeviceTimelineSemaphoreFeatures in its pNext chain.
     * What the library uses becomes VK_TRUE there, the rest stays */
    void* features;
    const char* const* extensions; /* out: extensions of the device to enable; valid for ever */
    uint32_t extension_count;      /* out */
    uint32_t reserved;
} splat_vulkan_requirements;

/* Say what to enable on a device. Needed are Vulkan 1.2 of the instance (apiVersion) and the device, a
 * queue with compute, timelineSemaphore, and VK_KHR_portability_subset where the device has it.
 * shaderInt64 is asked for where CPU devices have it, whose kernels are fast with it only.
 * needs     in/out, struct_size set
 * Returns SPLAT_OK, or
 *   SPLAT_ERROR_INVALID_ARGUMENT  NULL, a struct_size, a physical device of another instance, a chain
 *                                 without the structs above
 *   SPLAT_ERROR_UNSUPPORTED       the device lacks what is needed; the message lists all of it
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY */
SPLAT_API splat_result splat_device_requirements(splat_vulkan_requirements* needs);

/* A device of an application. */
typedef struct splat_vulkan_desc {
    uint32_t struct_size;
    uint32_t flags;   /* 0 */
    const void* next; /* NULL */
    splat_vulkan_function get_instance_proc_addr; /* vkGetInstanceProcAddr */
    void* instance;                               /* VkInstance */
    void* physical_device;                        /* VkPhysicalDevice of the instance */
    void* device;                                 /* VkDevice of the physical device */
    void* queue;                                  /* VkQueue of the device */
    uint32_t queue_family;                        /* the queue's, with compute */
    uint32_t api_version;                         /* VkApplicationInfo.apiVersion of the instance */
    const char* const* extensions; /* names of the extensions enabled on the device */
    uint32_t extension_count;
    uint32_t reserved;
    /* VkPhysicalDeviceFeatures2 with its chain, as passed to vkCreateDevice; read before the call
     * returns. What is not enabled there or in `extensions` the library does not use */
    const void* features;
    /* Called before and after each use of the queue (vkQueueSubmit, vkQueueWaitIdle). Both NULL: nobody
     * else uses the queue while a call of the library runs, or while another libsplat device has it */
    splat_queue_callback lock_queue;
    splat_queue_callback unlock_queue;
    void* user; /* passed to both */
} splat_vulkan_desc;

/* Open a device of the library on one of the application: all calls work there, on its queue. Several may
 * share one VkDevice. A device that is lost is the application's to create anew. Wrong handles are refused
 * where Vulkan tells, and undefined elsewhere.
 * vulkan    what the application has
 * desc      as for splat_device_create, with zero in select, index, kind, uuid, and without
 *           SPLAT_DEVICE_VALIDATION, which the application's instance decides; may be NULL
 * device    out, owned by the caller
 * Returns SPLAT_OK, or
 *   SPLAT_ERROR_INVALID_ARGUMENT  a field of vulkan or desc; one callback without the other; a physical
 *                                 device or a family of queues that the instance does not have
 *   SPLAT_ERROR_UNSUPPORTED       the device was made without what is needed: the message lists all
 *                                 versions, features and extensions that are missing; nothing was made
 *   SPLAT_ERROR_INVALID_STATE     forked, see core.h
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_ERROR_DEVICE_LOST */
SPLAT_API splat_result splat_device_from_vulkan(const splat_vulkan_desc* vulkan,
                                                const splat_device_desc* desc,
                                                splat_device* device);

/* The application's image or buffer that receives a view. Pixels are RGB over the background and alpha, as
 * the rasterizer has them: linear with SPLAT_RASTERIZER_LINEAR_COLORS. */
typedef struct splat_vulkan_target {
    uint32_t struct_size;
    uint32_t flags;   /* 0 */
    const void* next; /* NULL */
    /* VkImage of W x H pixels, with VK_IMAGE_USAGE_TRANSFER_DST_BIT: its first level and layer are written.
     * It may be in any layout, what it held is lost, and it is left in `layout`. 0: a buffer */
    uint64_t image;
    /* VkBuffer with VK_BUFFER_USAGE_TRANSFER_DST_BIT, for rows without gaps from `offset` on. 0: an image */
    uint64_t buffer;
    uint64_t offset; /* bytes, a multiple of 4; 0 with an image */
    uint64_t bytes;  /* room in the buffer from `offset` on; 0 with an image */
    /* VkFormat of the pixels: VK_FORMAT_R8G8B8A8_UNORM (37), rounded and clamped as in files;
     * VK_FORMAT_R16G16B16A16_SFLOAT (97), rounded as the device does; VK_FORMAT_R32G32B32A32_SFLOAT (109) */
    uint32_t format;
    uint32_t layout; /* VkImageLayout that the image is left in, not 0 or 8; 0 with a buffer */
    /* VkSemaphore, binary or timeline, that the device waits for before it writes; 0: none. What came
     * before on the same queue has read the target in any case */
    uint64_t wait_semaphore;
    uint64_t wait_value; /* what a timeline semaphore must reach; 0 with a binary one */
} splat_vulkan_target;

/* A frame that was given to the device. */
typedef struct splat_vulkan_frame {
    uint32_t struct_size;
    uint32_t waited;    /* out: 1 if the host waited until it was drawn, see splat_rasterizer_submit */
    uint64_t semaphore; /* out: VkSemaphore of type timeline, the device's until it closes */
    uint64_t value;     /* out: what the semaphore reaches when the target is written; rises by frame */
    /* out: value of an earlier frame of this state whose target shows less than the scene; 0: none */
    uint64_t lost;
} splat_vulkan_frame;

/* Draw a scene into an image or buffer of the application, without waiting for the device. The application
 * waits on the device: a submit that waits for frame->value sees the target written, at any stage, on any
 * queue of the same family; a host waits by vkWaitSemaphores. A target that is not of
 * VK_SHARING_MODE_CONCURRENT belongs to the queue's family then; for others the application hands it over.
 * It must live until then, as must the semaphore waited for.
 *
 * What the host waits for:
 *   - the frame before on this device, if it still runs: there is one at a time, as all calls but those that
 *     never wait (core.h) wait for it;
 *   - this frame to be drawn, where it is the first one or memory, scene, or numbers have changed since the
 *     last: the host then learns how much memory it needs. `waited` says so;
 *   - the same for a scene that needs several passes, or lists of a tile in parts.
 * Between these, a frame that needs more than a quarter more memory than all before, as after a cut of the
 * camera, is lost: it shows the background, or lists up to a limit. The next call tells by `lost`, has the
 * memory, and waits. splat_rasterizer_forward_scene before the frame makes sure that it has.
 * splat_device_cancel does not end what was submitted, and splat_rasterizer_get_info describes the frame
 * before until another call waits. Reading outputs waits for the frame.
 * state       of this rasterizer; NULL: its own
 * background  exactly 3 floats RGB; NULL = black
 * target      the view, W x H pixels of the rasterizer; the library writes nowhere else
 * frame       out, struct_size set
 * Returns as splat_rasterizer_forward_scene for one camera, or
 *   SPLAT_ERROR_INVALID_ARGUMENT  also a field of target: both or neither of image and buffer, another
 *                                 format, an offset, too few bytes
 *   SPLAT_ERROR_INVALID_STATE     also for a device that splat_device_from_vulkan did not open
 *   SPLAT_ERROR_UNSUPPORTED       also a scene of more Gaussians than the device takes at a time
 * After an error the target is untouched and wait_semaphore is not waited for, but for
 * SPLAT_ERROR_DEVICE_LOST. */
SPLAT_API splat_result splat_rasterizer_submit(splat_rasterizer rasterizer, splat_raster_state state,
                                               splat_scene scene, const splat_camera* camera,
                                               const float* background,
                                               const splat_vulkan_target* target, splat_vulkan_frame* frame);

#ifdef __cplusplus
}
#endif

#endif /* SPLAT_VULKAN_H */

#include "vk/instance.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <mutex>

#include "core/environment.h"
#include "core/fault.h"
#include "core/fork.h"
#include "core/log.h"
#include "core/os/drivers.h"
#include "vk/device_exit.h"

namespace splat::vk {
namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";

std::weak_ptr<Instance> g_instances[2];  // without and with validation
std::atomic<std::uint64_t> g_messages{0};

constexpr std::uint32_t kNone = ~std::uint32_t{0};
std::uint32_t g_opened_by = kNone;  ///< fork_generation() of the process that made the first one

/// They are the parent's.
void forget_instances() {
    for (std::weak_ptr<Instance>& instance : g_instances) instance.reset();
}

/// Guards g_instances and g_opened_by. Never destroyed: devices may live until the end of the process.
struct InstancesMutex : ForkMutex {};
InstancesMutex& instances_mutex() {
    return for_ever<InstancesMutex, forget_instances>();
}

/// The layer's warnings of itself, from 1.3.280 on: its speed, and what it adds to the device for its own shaders.
/// They come with every instance and device, and no call of ours can be meant.
bool is_of_the_layer_itself(VkDebugUtilsMessageSeverityFlagBitsEXT severity,
                            const VkDebugUtilsMessengerCallbackDataEXT& data) {
    constexpr struct {
        const char* id;
        const char* text;
    } kOwn[] = {
        {"VALIDATION-SETTINGS", "Both GPU Assisted Validation and Normal Core Check Validation"},
        {"WARNING-GPU-Assisted-Validation", "Internal Warning: Adding a VkPhysicalDevice"},
        {"WARNING-GPU-Assisted-Validation", "Internal Warning: Forcing "},
        {"WARNING-GPU-Assisted-Validation",
         "Internal Warning: Setting VkPhysicalDeviceVulkan12Properties::maxUpdateAfterBind"},
        {"WARNING-GPU-Assisted-Validation", "[Disabling gpuav_validate_ray_query]"},
    };
    if (severity > VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT ||
        data.pMessageIdName == nullptr)
        return false;
    return std::ranges::any_of(kOwn, [&](const auto& own) {
        return std::strcmp(data.pMessageIdName, own.id) == 0 &&
               std::strstr(data.pMessage, own.text) != nullptr;
    });
}

/// Messages of the layer on calls are counted; the loader's own ("general") and the layer's on itself are only
/// passed on.
VKAPI_ATTR VkBool32 VKAPI_CALL on_message(VkDebugUtilsMessageSeverityFlagBitsEXT severity,
                                          VkDebugUtilsMessageTypeFlagsEXT type,
                                          const VkDebugUtilsMessengerCallbackDataEXT* data, void*) {
    if (devices_ended_at_exit()) return VK_FALSE;  // what was alive then is no leak
    if (is_of_the_layer_itself(severity, *data)) {
        try {
            log(LogLevel::kInfo, std::string("[vulkan] ") + data->pMessage);
        } catch (...) {  // no memory for the text
        }
        return VK_FALSE;
    }
    const bool validation = (type & VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT) != 0;
    if (validation) g_messages.fetch_add(1, std::memory_order_relaxed);
    try {
        const bool is_error = severity >= VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
        log(is_error ? LogLevel::kError : LogLevel::kWarning,
            std::string(validation ? "[validation] " : "[vulkan] ") + data->pMessage);
    } catch (...) {  // no memory for the text; the count is kept
    }
    return VK_FALSE;
}

VkDebugUtilsMessengerCreateInfoEXT messenger_info() {
    VkDebugUtilsMessengerCreateInfoEXT info{
        .sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT,
        .messageSeverity = VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT |
                           VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT,
        .messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_GENERAL_BIT_EXT |
                       VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT,
        .pfnUserCallback = on_message};
    return info;
}

/// The version of the layer; 0 without it.
std::uint32_t validation_layer() {
    std::uint32_t count = 0;
    if (vkEnumerateInstanceLayerProperties(&count, nullptr) != VK_SUCCESS) return 0;
    std::vector<VkLayerProperties> layers(count);
    if (vkEnumerateInstanceLayerProperties(&count, layers.data()) < VK_SUCCESS) return 0;
    for (const VkLayerProperties& layer : layers)
        if (std::strcmp(layer.layerName, kValidationLayer) == 0) return layer.specVersion;
    return 0;
}

/// Whether the loader inserts the layer anyway. Wine's Vulkan lists no layers: those of the system below come so.
bool is_inserted() {
    return environment("VK_INSTANCE_LAYERS").value_or("").find(kValidationLayer) !=
           std::string::npos;
}

/// What the layer is asked to check. Points into itself.
class LayerFeatures : NoCopy {
  public:
    /// Adds the extension that the settings need, if any.
    LayerFeatures(std::uint32_t layer_version, std::vector<const char*>& extensions) {
        features_.sType = VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT;
        features_.pNext = &messenger_;
        features_.enabledValidationFeatureCount = static_cast<std::uint32_t>(std::size(kEnables));
        features_.pEnabledValidationFeatures = kEnables;
#ifdef VK_EXT_layer_settings
        // Since 1.3.296 synchronisation validation leaves out the accesses of shaders otherwise.
        if (layer_version < VK_MAKE_API_VERSION(0, 1, 3, 296)) return;
        extensions.push_back(VK_EXT_LAYER_SETTINGS_EXTENSION_NAME);
        messenger_.pNext = &settings_;
#else
        static_cast<void>(layer_version);
        static_cast<void>(extensions);
#endif
    }

    [[nodiscard]] const void* chain() const {
        return &features_;
    }

  private:
    // GPU-assisted validation reserves its own descriptor set, so that every set number below it stays ours.
    static constexpr VkValidationFeatureEnableEXT kEnables[] = {
        VK_VALIDATION_FEATURE_ENABLE_GPU_ASSISTED_EXT,
        VK_VALIDATION_FEATURE_ENABLE_GPU_ASSISTED_RESERVE_BINDING_SLOT_EXT,
        VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT,
    };
    VkDebugUtilsMessengerCreateInfoEXT messenger_ = messenger_info();
    VkValidationFeaturesEXT features_{};
#ifdef VK_EXT_layer_settings
    VkBool32 on_ = VK_TRUE;
    VkLayerSettingEXT shader_accesses_{kValidationLayer, "syncval_shader_accesses_heuristic",
                                       VK_LAYER_SETTING_TYPE_BOOL32_EXT, 1, &on_};
    VkLayerSettingsCreateInfoEXT settings_{VK_STRUCTURE_TYPE_LAYER_SETTINGS_CREATE_INFO_EXT,
                                           nullptr, 1, &shader_accesses_};
#endif
};

Status load_loader() {
    static const VkResult result = volkInitialize();
    if (result == VK_SUCCESS && !SPLAT_FAULT("vk.loader")) return {};
    return Status(Code::kNoDevice, os::no_loader());
}

/// True if a function that counts and lists extensions has that one.
template <class List>
bool lists(const List& list, const char* name) {
    std::uint32_t count = 0;
    if (list(&count, nullptr) != VK_SUCCESS) return false;
    std::vector<VkExtensionProperties> found(count);
    if (list(&count, found.data()) < VK_SUCCESS) return false;
    found.resize(count);
    return std::ranges::any_of(
        found, [&](const auto& one) { return std::strcmp(one.extensionName, name) == 0; });
}

/// Set `function` to the one of that name that `get` finds for an instance. Returns whether there is one.
template <class Function>
bool load_function(PFN_vkGetInstanceProcAddr get, VkInstance instance, Function& function,
                   const char* name) {
    function = reinterpret_cast<Function>(get(instance, name));
    return function != nullptr;
}

/// For the holder of the mutex. Drivers keep threads, which a fork does not copy, and wait for them when the process
/// exits.
Status check_fork() {
    if (g_opened_by == kNone || g_opened_by == fork_generation()) return {};
    return bad_state(
        "this process was forked from one that had opened or listed devices, whose "
        "drivers do not work in a child: start children with spawn, or fork before "
        "that");
}

}  // namespace

std::uint64_t validation_messages() {
    return g_messages.load(std::memory_order_relaxed);
}

const char* result_name(VkResult result) {
#define SPLAT_NAMED(name) std::pair(name, #name)
    static constexpr std::pair<VkResult, const char*> kNames[] = {
        SPLAT_NAMED(VK_SUCCESS),
        SPLAT_NAMED(VK_NOT_READY),
        SPLAT_NAMED(VK_TIMEOUT),
        SPLAT_NAMED(VK_EVENT_SET),
        SPLAT_NAMED(VK_EVENT_RESET),
        SPLAT_NAMED(VK_INCOMPLETE),
        SPLAT_NAMED(VK_ERROR_OUT_OF_HOST_MEMORY),
        SPLAT_NAMED(VK_ERROR_OUT_OF_DEVICE_MEMORY),
        SPLAT_NAMED(VK_ERROR_INITIALIZATION_FAILED),
        SPLAT_NAMED(VK_ERROR_DEVICE_LOST),
        SPLAT_NAMED(VK_ERROR_MEMORY_MAP_FAILED),
        SPLAT_NAMED(VK_ERROR_LAYER_NOT_PRESENT),
        SPLAT_NAMED(VK_ERROR_EXTENSION_NOT_PRESENT),
        SPLAT_NAMED(VK_ERROR_FEATURE_NOT_PRESENT),
        SPLAT_NAMED(VK_ERROR_INCOMPATIBLE_DRIVER),
        SPLAT_NAMED(VK_ERROR_TOO_MANY_OBJECTS),
        SPLAT_NAMED(VK_ERROR_FORMAT_NOT_SUPPORTED),
        SPLAT_NAMED(VK_ERROR_FRAGMENTED_POOL),
        SPLAT_NAMED(VK_ERROR_UNKNOWN),
        SPLAT_NAMED(VK_ERROR_OUT_OF_POOL_MEMORY),
        SPLAT_NAMED(VK_ERROR_INVALID_EXTERNAL_HANDLE),
        SPLAT_NAMED(VK_ERROR_FRAGMENTATION),
        SPLAT_NAMED(VK_ERROR_INVALID_OPAQUE_CAPTURE_ADDRESS),
        SPLAT_NAMED(VK_PIPELINE_COMPILE_REQUIRED),
        SPLAT_NAMED(VK_ERROR_VALIDATION_FAILED_EXT),
        SPLAT_NAMED(VK_ERROR_INVALID_SHADER_NV)};
#undef SPLAT_NAMED
    for (const auto& [code, name] : kNames)
        if (code == result) return name;
    return "an unexpected VkResult";
}

Result<std::shared_ptr<Instance>> Instance::get(bool validation) {
    const std::lock_guard lock(instances_mutex());
    std::weak_ptr<Instance>& slot = g_instances[validation ? 1 : 0];
    if (auto living = slot.lock()) return living;
    SPLAT_TRY(check_fork());
    SPLAT_ASSIGN(std::shared_ptr<Instance> instance, create(validation));
    g_opened_by = fork_generation();
    slot = instance;
    return instance;
}

Result<std::shared_ptr<Instance>> Instance::adopt(const Adopted& from) {
    const std::lock_guard lock(instances_mutex());
    SPLAT_TRY(check_fork());
    std::shared_ptr<Instance> instance(new Instance);
    instance->get_function_ =
        reinterpret_cast<PFN_vkGetInstanceProcAddr>(from.get_instance_proc_addr);
    instance->instance_ = static_cast<VkInstance>(from.instance);
    SPLAT_TRY(instance->load_functions());
    g_opened_by = fork_generation();
    return instance;
}

Result<std::shared_ptr<Instance>> Instance::create(bool validation) {
    SPLAT_TRY(load_loader());
    const std::uint32_t layer = validation ? validation_layer() : 0;
    if (validation && layer == 0 && !is_inserted())
        return unsupported(
            "validation was requested, but the layer %s is not installed: on Debian `apt-get "
            "install "
            "vulkan-validationlayers`, or clear SPLAT_DEVICE_VALIDATION and SPLAT_VALIDATION",
            kValidationLayer);

    VkApplicationInfo application{.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO,
                                  .pEngineName = "libsplat",
                                  .apiVersion = VK_API_VERSION_1_2};

    std::vector<const char*> extensions;
    VkInstanceCreateInfo info{.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO,
                              .pApplicationInfo = &application};
    // Without it the loader hides drivers of a part of Vulkan, such as MoltenVK.
    if (lists([](auto... to) { return vkEnumerateInstanceExtensionProperties(nullptr, to...); },
              VK_KHR_PORTABILITY_ENUMERATION_EXTENSION_NAME)) {
        extensions.push_back(VK_KHR_PORTABILITY_ENUMERATION_EXTENSION_NAME);
        info.flags = VK_INSTANCE_CREATE_ENUMERATE_PORTABILITY_BIT_KHR;
    }
    std::vector<const char*> checks{VK_EXT_DEBUG_UTILS_EXTENSION_NAME};
    const LayerFeatures features(layer, checks);
    if (validation) {
        info.pNext = features.chain();
        info.enabledLayerCount = layer == 0 ? 0 : 1;
        info.ppEnabledLayerNames = &kValidationLayer;
        extensions.insert(extensions.end(), checks.begin(), checks.end());
    }
    info.enabledExtensionCount = static_cast<std::uint32_t>(extensions.size());
    info.ppEnabledExtensionNames = extensions.data();
    std::shared_ptr<Instance> instance(new Instance);
    instance->validation_ = validation;
    instance->get_function_ = vkGetInstanceProcAddr;
    const VkResult result = SPLAT_FAULT("vk.create_instance")
                                ? VK_ERROR_OUT_OF_HOST_MEMORY
                                : vkCreateInstance(&info, nullptr, &instance->instance_);
    if (result == VK_ERROR_OUT_OF_HOST_MEMORY)
        return error(Code::kOutOfHostMemory, "vkCreateInstance: out of host memory");
    if (result != VK_SUCCESS)
        return error(Code::kNoDevice,
                     "vkCreateInstance failed with %s: no usable Vulkan driver; %s",
                     result_name(result), os::install_driver().c_str());
    if (validation) end_devices_before(layer);
    load_function(vkGetInstanceProcAddr, instance->instance_, instance->destroy_instance_,
                  "vkDestroyInstance");
    SPLAT_TRY(instance->load_functions());
    if (validation) SPLAT_TRY(instance->create_messenger());
    SPLAT_TRY(instance->enumerate());
    return instance;
}

Status Instance::load_functions() {
    const auto load = [this](auto& function, const char* name) {
        return load_function(get_function_, instance_, function, name);
    };
    if (!load(get_device_function_, "vkGetDeviceProcAddr") ||
        !load(get_properties2, "vkGetPhysicalDeviceProperties2") ||
        !load(get_features2, "vkGetPhysicalDeviceFeatures2") ||
        !load(get_memory_properties, "vkGetPhysicalDeviceMemoryProperties") ||
        !load(get_queue_families, "vkGetPhysicalDeviceQueueFamilyProperties") ||
        !load(get_external_buffer, "vkGetPhysicalDeviceExternalBufferProperties") ||
        !load(create_device, "vkCreateDevice") ||
        !load(get_extensions, "vkEnumerateDeviceExtensionProperties"))
        return error(Code::kNoDevice,
                     "the Vulkan loader is older than 1.1; install one of 1.2 or later");
    return {};
}

Status Instance::load(VolkDeviceTable& table, VkDevice device) const {
    // volk reads this global, and an application may have another loader.
    const std::lock_guard lock(instances_mutex());
    vkGetDeviceProcAddr = get_device_function_;
    volkLoadDeviceTable(&table, device);
    if (table.vkQueueSubmit != nullptr && table.vkGetSemaphoreCounterValue != nullptr) return {};
    return invalid("vkGetDeviceProcAddr knows no functions of Vulkan 1.2 of the device");
}

bool Instance::has_extension(VkPhysicalDevice device, const char* name) const {
    return lists([&](auto... to) { return get_extensions(device, nullptr, to...); }, name);
}

Status Instance::create_messenger() {
    PFN_vkCreateDebugUtilsMessengerEXT make = nullptr;
    const VkDebugUtilsMessengerCreateInfoEXT info = messenger_info();
    if (!load_function(get_function_, instance_, make, "vkCreateDebugUtilsMessengerEXT") ||
        !load_function(get_function_, instance_, destroy_messenger_,
                       "vkDestroyDebugUtilsMessengerEXT") ||
        make(instance_, &info, nullptr, &messenger_) != VK_SUCCESS)
        return unsupported("validation was requested, but VK_EXT_debug_utils has no messenger");
    return {};
}

Status Instance::enumerate() {
    PFN_vkEnumeratePhysicalDevices list = nullptr;
    load_function(get_function_, instance_, list, "vkEnumeratePhysicalDevices");
    std::uint32_t count = 0;
    VkResult result = list(instance_, &count, nullptr);
    if (result == VK_SUCCESS && count > 0) {
        devices_.resize(count);
        result = list(instance_, &count, devices_.data());
        devices_.resize(count);
    }
    if (result == VK_ERROR_OUT_OF_HOST_MEMORY)
        return error(Code::kOutOfHostMemory, "vkEnumeratePhysicalDevices: out of host memory");
    if (result != VK_SUCCESS && result != VK_INCOMPLETE && result != VK_ERROR_INITIALIZATION_FAILED)
        return error(Code::kNoDevice, "vkEnumeratePhysicalDevices failed with %s",
                     result_name(result));
    return {};
}

Instance::~Instance() {
    if (validation_ && devices_ended_at_exit()) return;  // the layer has forgotten it
    if (messenger_ != VK_NULL_HANDLE) destroy_messenger_(instance_, messenger_, nullptr);
    if (instance_ != VK_NULL_HANDLE && destroy_instance_ != nullptr)
        destroy_instance_(instance_, nullptr);
}

}  // namespace splat::vk

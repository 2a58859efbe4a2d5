#include "vk/caller/requirements.h"

#include <algorithm>
#include <cstring>

#include "vk/external_memory.h"

namespace splat::vk {
namespace {

constexpr const char* kSubset = "VK_KHR_portability_subset";
constexpr const char* kSubsets[] = {kSubset};

/// Functions of Vulkan 1.0, which every instance has.
struct Functions {
    PFN_vkEnumeratePhysicalDevices list = nullptr;
    PFN_vkGetPhysicalDeviceProperties properties = nullptr;
    PFN_vkGetPhysicalDeviceFeatures features = nullptr;
    PFN_vkGetPhysicalDeviceQueueFamilyProperties families = nullptr;
    PFN_vkEnumerateDeviceExtensionProperties extensions = nullptr;
};

/// What a physical device of the application has.
struct Physical {
    std::uint32_t index = 0;
    VkPhysicalDeviceProperties properties{};
    VkPhysicalDeviceFeatures features{};
    std::vector<VkQueueFamilyProperties> families;
    bool subset = false;
};

Result<Functions> functions_of(const Adopted& from) {
    const auto get = reinterpret_cast<PFN_vkGetInstanceProcAddr>(from.get_instance_proc_addr);
    auto* const instance = static_cast<VkInstance>(from.instance);
    Functions found;
    const auto load = [&](auto& function, const char* name) {
        function =
            reinterpret_cast<std::remove_reference_t<decltype(function)>>(get(instance, name));
        return function != nullptr;
    };
    if (load(found.list, "vkEnumeratePhysicalDevices") &&
        load(found.properties, "vkGetPhysicalDeviceProperties") &&
        load(found.features, "vkGetPhysicalDeviceFeatures") &&
        load(found.families, "vkGetPhysicalDeviceQueueFamilyProperties") &&
        load(found.extensions, "vkEnumerateDeviceExtensionProperties"))
        return found;
    return invalid("get_instance_proc_addr knows no functions of the instance");
}

Result<Physical> physical_of(const Adopted& from) {
    SPLAT_ASSIGN(const Functions vk, functions_of(from));
    std::uint32_t count = 0;
    std::vector<VkPhysicalDevice> devices;
    if (vk.list(static_cast<VkInstance>(from.instance), &count, nullptr) == VK_SUCCESS) {
        devices.resize(count);
        if (vk.list(static_cast<VkInstance>(from.instance), &count, devices.data()) < VK_SUCCESS)
            count = 0;
        devices.resize(count);
    }
    auto* const physical = static_cast<VkPhysicalDevice>(from.physical_device);
    const auto at = std::ranges::find(devices, physical);
    if (at == devices.end())
        return invalid("physical_device is none of the %zu that the instance lists",
                       devices.size());
    Physical found;
    found.index = static_cast<std::uint32_t>(at - devices.begin());
    vk.properties(physical, &found.properties);
    vk.features(physical, &found.features);
    vk.families(physical, &count, nullptr);
    found.families.resize(count);
    vk.families(physical, &count, found.families.data());
    if (vk.extensions(physical, nullptr, &count, nullptr) != VK_SUCCESS) count = 0;
    std::vector<VkExtensionProperties> extensions(count);
    if (vk.extensions(physical, nullptr, &count, extensions.data()) < VK_SUCCESS)
        extensions.clear();
    found.subset = std::ranges::any_of(extensions, [](const VkExtensionProperties& one) {
        return std::strcmp(one.extensionName, kSubset) == 0;
    });
    return found;
}

/// Where a chain of features has those that the library uses.
template <class Flag>
struct Places {
    Flag* int64 = nullptr;
    Flag* timeline = nullptr;
};

/// `Link`: VkBaseInStructure or VkBaseOutStructure. Errors: kInvalidArgument for a chain that has no end.
template <class Flag, class Features2, class Features12, class Timeline, class Link, class Pointer>
Result<Places<Flag>> places_of(Pointer features) {
    constexpr int kMostLinks = 256;
    Places<Flag> found;
    int links = 0;
    for (auto* link = static_cast<Link*>(features); link != nullptr; link = link->pNext) {
        if (++links > kMostLinks)
            return invalid("features is a chain of more than %d structs, expected its end",
                           kMostLinks);
        if (link->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2)
            found.int64 = &reinterpret_cast<Features2*>(link)->features.shaderInt64;
        if (link->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES)
            found.timeline = &reinterpret_cast<Features12*>(link)->timelineSemaphore;
        if (link->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_TIMELINE_SEMAPHORE_FEATURES)
            found.timeline = &reinterpret_cast<Timeline*>(link)->timelineSemaphore;
    }
    return found;
}

/// What neither an instance nor an application can change, in words.
void add_lacks(const Physical& physical, std::vector<std::string>& missing) {
    const std::uint32_t version = physical.properties.apiVersion;
    if (version < VK_API_VERSION_1_2)
        missing.push_back(format("Vulkan 1.2 of the device (it has %u.%u)",
                                 VK_API_VERSION_MAJOR(version), VK_API_VERSION_MINOR(version)));
}

Status lacking(const char* whose, const Physical& physical, const std::vector<std::string>& missing,
               const char* advice) {
    if (missing.empty()) return {};
    std::string list;
    for (const std::string& one : missing) list += (list.empty() ? "" : "; ") + one;
    return unsupported("%s (%s) lacks what the library needs: %s%s", whose,
                       physical.properties.deviceName, list.c_str(), advice);
}

}  // namespace

Result<Requirements> require_of(const Adopted& from, void* features) {
    SPLAT_ASSIGN(const Physical physical, physical_of(from));
    using Chain = Places<VkBool32>;
    SPLAT_ASSIGN(
        const Chain places,
        (places_of<VkBool32, VkPhysicalDeviceFeatures2, VkPhysicalDeviceVulkan12Features,
                   VkPhysicalDeviceTimelineSemaphoreFeatures, VkBaseOutStructure>(features)));
    if (places.int64 == nullptr || places.timeline == nullptr)
        return invalid(
            "features is a chain without %s, expected VkPhysicalDeviceFeatures2 and, in its pNext, "
            "VkPhysicalDeviceVulkan12Features or VkPhysicalDeviceTimelineSemaphoreFeatures",
            places.int64 == nullptr ? "VkPhysicalDeviceFeatures2" : "a member timelineSemaphore");
    std::vector<std::string> missing;
    add_lacks(physical, missing);
    const auto family = compute_family(physical.families);
    if (!family) missing.emplace_back("a queue family with compute");
    SPLAT_TRY(lacking("the device", physical, missing, ": use another device"));
    // Every device of Vulkan 1.2 has timeline semaphores.
    *places.timeline = VK_TRUE;
    if (physical.features.shaderInt64 == VK_TRUE) *places.int64 = VK_TRUE;
    Requirements needs{.queue_family = *family, .extensions = {}};
    if (physical.subset) needs.extensions = kSubsets;
    return needs;
}

Result<Enabled> check_adopted(const Adopted& from) {
    SPLAT_ASSIGN(const Physical physical, physical_of(from));
    const void* const handles[] = {from.instance, from.physical_device, from.device, from.queue};
    for (const void* const& handle : handles)
        if (std::ranges::count(handles, handle) > 1)
            return invalid(
                "two of instance, physical_device, device and queue are the same handle");
    if (from.queue_family >= physical.families.size())
        return invalid("queue_family is %u, expected less than %zu, the families of the device",
                       from.queue_family, physical.families.size());
    using Chain = Places<const VkBool32>;
    SPLAT_ASSIGN(
        const Chain places,
        (places_of<const VkBool32, const VkPhysicalDeviceFeatures2,
                   const VkPhysicalDeviceVulkan12Features,
                   const VkPhysicalDeviceTimelineSemaphoreFeatures, const VkBaseInStructure>(
            from.features)));
    const auto enabled = [&](const char* name) {
        return std::ranges::find(from.extensions, name) != from.extensions.end();
    };
    std::vector<std::string> missing;
    if (from.api_version < VK_API_VERSION_1_2)
        missing.push_back(format("Vulkan 1.2 of the instance (its apiVersion is %u.%u)",
                                 VK_API_VERSION_MAJOR(from.api_version),
                                 VK_API_VERSION_MINOR(from.api_version)));
    add_lacks(physical, missing);
    if ((physical.families[from.queue_family].queueFlags & VK_QUEUE_COMPUTE_BIT) == 0)
        missing.push_back(format("compute of queue family %u", from.queue_family));
    if (places.timeline == nullptr || *places.timeline != VK_TRUE)
        missing.emplace_back("the feature timelineSemaphore");
    if (physical.subset && !enabled(kSubset))
        missing.push_back(std::string("the extension ") + kSubset);
    SPLAT_TRY(lacking("the application's device", physical, missing,
                      ": enable it when instance and device are made"));
    return Enabled{.index = physical.index,
                   .int64 = places.int64 != nullptr && *places.int64 == VK_TRUE,
                   .external_memory = enabled(kExternalMemoryExtension)};
}

}  // namespace splat::vk

// A device of MoltenVK's features, limits and extensions alone, as Macs with Apple's GPUs have it: what the library
// asks for is there, and what it loads needs no more. Lanes, memory types and the compiler stay the driver's.
//
// The profile is that of MoltenVK 1.4.3 (commit 1484e7f8, MVKDevice.mm: initFeatures, initLimits, getProperties) for
// Metal's family Apple 7; the largest buffer is an M1's with 8 GiB.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "api/devices/device_objects.h"
#include "support/expect_status.h"
#include "vk/instance.h"
#include "vk/shaders.h"
#include "vk/spirv.h"

namespace splat::test {
namespace {

constexpr const char* kSubset = "VK_KHR_portability_subset";

/// MoltenVK has more; the library knows these.
constexpr std::array kExtensions = {kSubset, VK_KHR_MAINTENANCE_4_EXTENSION_NAME,
                                    VK_KHR_EXTERNAL_MEMORY_EXTENSION_NAME,
                                    VK_EXT_SUBGROUP_SIZE_CONTROL_EXTENSION_NAME};

VkPhysicalDeviceFeatures features_there() {
    VkPhysicalDeviceFeatures there{};
    there.robustBufferAccess = VK_TRUE;
    there.shaderInt16 = there.shaderInt64 = VK_TRUE;
    there.fragmentStoresAndAtomics = there.vertexPipelineStoresAndAtomics = VK_TRUE;
    return there;
}

void lower(VkPhysicalDeviceLimits& limits) {
    limits.maxPushConstantsSize = 4096;
    limits.maxComputeSharedMemorySize = 32 << 10;
    limits.maxPerStageDescriptorStorageBuffers = 31;
    limits.maxStorageBufferRange = ~std::uint32_t{0};
    limits.maxTexelBufferElements = 16384 * 4096;
    limits.minStorageBufferOffsetAlignment = 16;
    limits.minTexelBufferOffsetAlignment = 16;
    limits.nonCoherentAtomSize = 256;
    limits.maxComputeWorkGroupInvocations = 1024;
    std::ranges::fill(limits.maxComputeWorkGroupSize, 1024U);
    std::ranges::fill(limits.maxComputeWorkGroupCount, ~std::uint32_t{0});
}

constexpr std::uint64_t kLargestBuffer = std::uint64_t{4} << 30;

/// The driver's own calls, and what the last device was asked for.
struct Driver {
    PFN_vkGetPhysicalDeviceProperties2 properties;
    PFN_vkGetPhysicalDeviceFeatures2 features;
    PFN_vkCreateDevice create;
    std::vector<std::string> asked;
} g_driver;

VKAPI_ATTR void VKAPI_CALL give_properties(VkPhysicalDevice physical,
                                           VkPhysicalDeviceProperties2* to) {
    g_driver.properties(physical, to);
    VkPhysicalDeviceProperties& core = to->properties;
    core.apiVersion = VK_API_VERSION_1_2;
    core.deviceType = VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU;
    core.vendorID = 0x106B;
    std::strcpy(core.deviceName, "Apple M1");
    lower(core.limits);
    for (auto* next = static_cast<VkBaseOutStructure*>(to->pNext); next != nullptr;
         next = next->pNext) {
        if (next->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_PROPERTIES) {
            auto* p11 = reinterpret_cast<VkPhysicalDeviceVulkan11Properties*>(next);
            p11->maxMemoryAllocationSize = kLargestBuffer;
            p11->subgroupSupportedOperations =
                VK_SUBGROUP_FEATURE_BASIC_BIT | VK_SUBGROUP_FEATURE_VOTE_BIT |
                VK_SUBGROUP_FEATURE_BALLOT_BIT | VK_SUBGROUP_FEATURE_SHUFFLE_BIT |
                VK_SUBGROUP_FEATURE_SHUFFLE_RELATIVE_BIT | VK_SUBGROUP_FEATURE_ARITHMETIC_BIT |
                VK_SUBGROUP_FEATURE_CLUSTERED_BIT | VK_SUBGROUP_FEATURE_QUAD_BIT;
        }
        if (next->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_PROPERTIES) {
            auto* p12 = reinterpret_cast<VkPhysicalDeviceVulkan12Properties*>(next);
            p12->driverID = VK_DRIVER_ID_MOLTENVK;
            p12->conformanceVersion = {1, 4, 4, 0};
            p12->shaderSignedZeroInfNanPreserveFloat32 = VK_TRUE;
            std::strcpy(p12->driverName, "MoltenVK");
            std::strcpy(p12->driverInfo, "1.4.3");
        }
        if (next->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_4_PROPERTIES)
            reinterpret_cast<VkPhysicalDeviceMaintenance4Properties*>(next)->maxBufferSize =
                kLargestBuffer;
        if (next->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_SIZE_CONTROL_PROPERTIES) {
            auto* lanes = reinterpret_cast<VkPhysicalDeviceSubgroupSizeControlProperties*>(next);
            lanes->minSubgroupSize = 4;
            lanes->maxSubgroupSize = 32;
        }
    }
}

VKAPI_ATTR void VKAPI_CALL give_features(VkPhysicalDevice, VkPhysicalDeviceFeatures2* to) {
    EXPECT_EQ(to->pNext, nullptr) << "a struct of features that the profile does not fill";
    to->features = features_there();
}

VKAPI_ATTR VkResult VKAPI_CALL list_extensions(VkPhysicalDevice, const char*, std::uint32_t* count,
                                               VkExtensionProperties* to) {
    *count = static_cast<std::uint32_t>(kExtensions.size());
    for (std::size_t i = 0; to != nullptr && i < kExtensions.size(); ++i)
        std::strcpy(to[i].extensionName, kExtensions[i]);
    return VK_SUCCESS;
}

/// What is asked for and not there.
std::vector<std::string> not_there(const VkDeviceCreateInfo& info) {
    std::vector<std::string> lacking;
    for (const std::string& asked : g_driver.asked)
        if (std::ranges::find(kExtensions, asked) == kExtensions.end())
            lacking.push_back("extension " + asked);
    for (const auto* next = static_cast<const VkBaseInStructure*>(info.pNext); next != nullptr;
         next = next->pNext) {
        if (next->sType != VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2) {
            lacking.push_back("struct " + std::to_string(next->sType));
            continue;
        }
        constexpr std::size_t kCount = sizeof(VkPhysicalDeviceFeatures) / sizeof(VkBool32);
        std::array<VkBool32, kCount> wanted{}, there{};
        const VkPhysicalDeviceFeatures all = features_there();
        std::memcpy(wanted.data(),
                    &reinterpret_cast<const VkPhysicalDeviceFeatures2*>(next)->features,
                    sizeof(VkPhysicalDeviceFeatures));
        std::memcpy(there.data(), &all, sizeof all);
        for (std::size_t i = 0; i < kCount; ++i)
            if (wanted[i] > there[i]) lacking.push_back("feature " + std::to_string(i));
    }
    return lacking;
}

VKAPI_ATTR VkResult VKAPI_CALL create_if_there(VkPhysicalDevice physical,
                                               const VkDeviceCreateInfo* info,
                                               const VkAllocationCallbacks* host,
                                               VkDevice* device) {
    g_driver.asked.assign(info->ppEnabledExtensionNames,
                          info->ppEnabledExtensionNames + info->enabledExtensionCount);
    EXPECT_EQ(not_there(*info), std::vector<std::string>());
    VkDeviceCreateInfo known = *info;  // the driver has no subset of its own
    known.enabledExtensionCount = 0;
    return g_driver.create(physical, &known, host, device);
}

class ApiPortability : public testing::Test {
  protected:
    void SetUp() override {
        instance_ = need(vk::Instance::get(false));
        get_extensions_ = instance_->get_extensions;
        g_driver = {
            instance_->get_properties2, instance_->get_features2, instance_->create_device, {}};
        instance_->get_properties2 = give_properties;
        instance_->get_features2 = give_features;
        instance_->get_extensions = list_extensions;
        instance_->create_device = create_if_there;
    }
    void TearDown() override {
        instance_->get_properties2 = g_driver.properties;
        instance_->get_features2 = g_driver.features;
        instance_->get_extensions = get_extensions_;
        instance_->create_device = g_driver.create;
    }

    std::shared_ptr<vk::Instance> instance_;
    PFN_vkEnumerateDeviceExtensionProperties get_extensions_ = nullptr;
};

TEST_F(ApiPortability, IsDescribedAsItIs) {
    const vk::DeviceInfo info = need(vk::describe_devices(*instance_)).at(0);
    EXPECT_TRUE(info.usable()) << info.reason;
    EXPECT_EQ(vk::kernels_text(info.kernels), "gpu");
    EXPECT_EQ(info.limits.max_storage_buffer_bytes, ~std::uint32_t{0});
    EXPECT_EQ(info.limits.max_allocation_bytes, kLargestBuffer);
    EXPECT_EQ(info.limits.offset_alignment, 256U);
    EXPECT_EQ(info.limits.least_lanes, 4U);
    EXPECT_EQ(info.limits.most_lanes, 32U);
    EXPECT_TRUE(info.features.nan_mode);
    EXPECT_FALSE(info.features.external_memory) << "it has no descriptors of memory";
}

/// The self-test runs before the first object of each family; a failure would fall back to plain kernels.
TEST_F(ApiPortability, EveryObjectRunsOnItsKernels) {
    const Device device = open_watched({});
    EXPECT_EQ(g_driver.asked, std::vector<std::string>{kSubset});
    EXPECT_DONE(run_operator(device));
    EXPECT_DONE(run_module(device));
    EXPECT_DONE(run_model(device));
    EXPECT_DONE(run_predictor(device));
    EXPECT_DONE(run_rasterizer(device));
    EXPECT_DONE(render_scene(device));
    EXPECT_DONE(run_trainer(device));
    EXPECT_DONE(run_fit(device));
    const splat_device_info info = got(splat_device_get_info, device);
    EXPECT_EQ(info.kernels, SPLAT_KERNELS_GPU);
    EXPECT_STREQ(info.kernels_note, "");
}

/// Kernels for CPUs alone need 64-bit integers, which old families of Metal lack.
TEST_F(ApiPortability, NoModuleNeedsMore) {
    vk::DeviceFeatures features = need(vk::describe_devices(*instance_)).at(0).features;
    features.int64 = false;
    std::size_t checked = 0;
    for (const vk::ShaderModule& module : vk::shader_modules()) {
        const std::string beyond = needed_beyond(module.words, features);
        if (std::string_view(module.name).ends_with("_cpu")) continue;
        ++checked;
        EXPECT_EQ(beyond, "") << module.name;
        const vk::ShaderInterface interface = need(vk::reflect(module.words));
        EXPECT_LE(interface.storage_buffers(), 31U) << module.name;
        EXPECT_LE(interface.push_bytes, 4096U) << module.name;
    }
    EXPECT_GE(checked, 100U);
}

TEST_F(ApiPortability, WhatNeedsMoreIsFound) {
    const vk::ShaderModule* fast = vk::find_shader("blend_backward_gpu");
    const vk::ShaderModule* wide = vk::find_shader("adam_cpu");
    const vk::ShaderModule* mode = vk::find_shader("exp_forward");
    ASSERT_TRUE(fast != nullptr && wide != nullptr && mode != nullptr);
    EXPECT_EQ(needed_beyond(wide->words, {}), "capability 11");
    EXPECT_EQ(needed_beyond(mode->words, {}), "capability 4466");
    EXPECT_HAS(needed_beyond(fast->words, {}), "capability 63");
    vk::DeviceFeatures features;
    features.subgroup_shuffle = features.subgroup_ballot = true;
    EXPECT_EQ(needed_beyond(fast->words, features), "capability 63");

    std::vector<std::uint32_t> words(wide->words.begin(), wide->words.begin() + 5);
    words.insert(words.end(), {3U << 16 | 10, 0x5F565053, 0x0000584B});  // OpExtension "SPV_KX"
    words[1] = 0x00010600;
    EXPECT_EQ(needed_beyond(words, {}), "version 67072, extension SPV_KX");

    VkPhysicalDeviceFeatures2 wanted{};
    wanted.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2;
    wanted.features.robustBufferAccess = wanted.features.fullDrawIndexUint32 = VK_TRUE;
    VkPhysicalDeviceVulkan12Features more{};
    more.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES;
    more.pNext = &wanted;
    VkDeviceCreateInfo info{};
    info.pNext = &more;
    g_driver.asked = {kSubset, "VK_KHR_external_memory_fd"};
    EXPECT_EQ(not_there(info), (std::vector<std::string>{"extension VK_KHR_external_memory_fd",
                                                         "struct 51", "feature 1"}));
}

}  // namespace
}  // namespace splat::test

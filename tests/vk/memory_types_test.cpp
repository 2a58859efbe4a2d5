#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"

namespace splat::vk {
namespace {

using Types = std::vector<std::uint32_t>;

constexpr VkMemoryPropertyFlags kLocal = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT;
constexpr VkMemoryPropertyFlags kCombined =  // slow to read
    VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
constexpr VkMemoryPropertyFlags kCached = kCombined | VK_MEMORY_PROPERTY_HOST_CACHED_BIT;

/// What the device claims to be, and what became of it. Its real memory type is 0.
struct Claims {
    VkPhysicalDeviceType kind = VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU;
    std::vector<VkMemoryPropertyFlags> types;
    std::set<std::uint32_t> full;  ///< types without room
    VkResult refusal = VK_ERROR_OUT_OF_DEVICE_MEMORY;
    Types tried;
    PFN_vkGetPhysicalDeviceProperties2 properties = nullptr;
    PFN_vkGetPhysicalDeviceMemoryProperties memory = nullptr;
    PFN_vkGetBufferMemoryRequirements requirements = nullptr;
    PFN_vkAllocateMemory allocate = nullptr;
};
Claims g_claims;

VKAPI_ATTR void VKAPI_CALL claim_kind(VkPhysicalDevice device, VkPhysicalDeviceProperties2* out) {
    g_claims.properties(device, out);
    out->properties.deviceType = g_claims.kind;
}

/// Heap 0 is local and small, heap 1 is the rest of the host's memory.
VKAPI_ATTR void VKAPI_CALL claim_types(VkPhysicalDevice, VkPhysicalDeviceMemoryProperties* out) {
    *out = {};
    out->memoryHeapCount = 2;
    out->memoryHeaps[0] = {std::uint64_t{64} << 20, VK_MEMORY_HEAP_DEVICE_LOCAL_BIT};
    out->memoryHeaps[1] = {std::uint64_t{1} << 30, 0};
    for (const VkMemoryPropertyFlags flags : g_claims.types)
        out->memoryTypes[out->memoryTypeCount++] = {flags, (flags & kLocal) != 0 ? 0U : 1U};
}

VKAPI_ATTR void VKAPI_CALL claim_needs(VkDevice device, VkBuffer buffer,
                                       VkMemoryRequirements* out) {
    g_claims.requirements(device, buffer, out);
    out->memoryTypeBits = (1U << g_claims.types.size()) - 1;
}

VKAPI_ATTR VkResult VKAPI_CALL allocate_claimed(VkDevice device, const VkMemoryAllocateInfo* info,
                                                const VkAllocationCallbacks* host,
                                                VkDeviceMemory* memory) {
    g_claims.tried.push_back(info->memoryTypeIndex);
    if (g_claims.full.contains(info->memoryTypeIndex)) return g_claims.refusal;
    VkMemoryAllocateInfo real = *info;
    real.memoryTypeIndex = 0;
    return g_claims.allocate(device, &real, host, memory);
}

class MemoryTypes : public testing::Test {
  protected:
    void SetUp() override {
        instance_ = need(Instance::get(test::validation_on()));
        g_claims = {};
        g_claims.properties = instance_->get_properties2;
        g_claims.memory = instance_->get_memory_properties;
        instance_->get_properties2 = claim_kind;
        instance_->get_memory_properties = claim_types;
    }
    void TearDown() override {
        instance_->get_properties2 = g_claims.properties;
        instance_->get_memory_properties = g_claims.memory;
    }

    static std::shared_ptr<Context> open(std::vector<VkMemoryPropertyFlags> types) {
        g_claims.types = std::move(types);
        ContextDesc desc = test::context_desc();
        desc.memory.hide_host = false;
        auto context = test::make_context(desc);
        VolkDeviceTable& vk = context->device().vk;
        g_claims.requirements = vk.vkGetBufferMemoryRequirements;
        g_claims.allocate = vk.vkAllocateMemory;
        vk.vkGetBufferMemoryRequirements = claim_needs;
        vk.vkAllocateMemory = allocate_claimed;
        return context;
    }

    /// The types tried for one buffer.
    static Types tried(Context& context, MemoryKind kind, std::set<std::uint32_t> full,
                       bool made = true) {
        g_claims.full = std::move(full);
        g_claims.tried.clear();
        const auto buffer = context.memory().allocate(4096, kind, "activations");
        if (made) {
            EXPECT_OK(buffer.status());
        } else {
            EXPECT_ERROR(buffer, Code::kOutOfDeviceMemory, "vkAllocateMemory");
        }
        return g_claims.tried;
    }

    static void expect_round_trip(Context& context) {
        std::vector<std::uint32_t> values(1000);
        for (std::uint32_t i = 0; i < 1000; ++i) values[i] = i;
        const Buffer buffer = test::upload(context, values);
        EXPECT_EQ(test::download_words(context, buffer.range(), 1000), values);
    }

    std::shared_ptr<Instance> instance_;
};

TEST_F(MemoryTypes, AnotherIsTriedWhereOneIsFull) {
    const auto context = open({kLocal, kLocal | kCombined, kCached, kCombined});
    EXPECT_EQ(tried(*context, MemoryKind::kDevice, {}), Types{0});
    EXPECT_EQ(tried(*context, MemoryKind::kDevice, {0}), (Types{0, 1}));
    EXPECT_EQ(tried(*context, MemoryKind::kDevice, {0, 1}), (Types{0, 1, 2}));
    EXPECT_EQ(tried(*context, MemoryKind::kDevice, {0, 1, 2, 3}, false), (Types{0, 1, 2, 3}));
    EXPECT_EQ(tried(*context, MemoryKind::kStaging, {}), Types{2});
    EXPECT_EQ(tried(*context, MemoryKind::kStaging, {2}), (Types{2, 1}));
    EXPECT_EQ(context->memory().use().used, 0U);
    g_claims.refusal = VK_ERROR_TOO_MANY_OBJECTS;
    EXPECT_EQ(tried(*context, MemoryKind::kDevice, {0}, false), Types{0});
}

TEST_F(MemoryTypes, HeapsThatAreTooSmallAreLeftOut) {
    const auto context = open({kCached, kLocal | kCombined});
    EXPECT_EQ(tried(*context, MemoryKind::kStaging, {0}), (Types{0, 1}));
    g_claims.tried.clear();
    EXPECT_ERROR(
        context->memory().allocate(std::uint64_t{65} << 20, MemoryKind::kStaging, "transfers"),
        Code::kOutOfDeviceMemory, "vkAllocateMemory");
    EXPECT_EQ(g_claims.tried, Types{0});
}

TEST_F(MemoryTypes, DiscreteDevicesComputeInTheirOwn) {
    g_claims.kind = VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU;
    const auto context = open({kCached, kLocal, kLocal | kCombined});
    EXPECT_EQ(tried(*context, MemoryKind::kDevice, {1, 2}, false), (Types{1, 2}));
    EXPECT_FALSE(context->device().info().features.unified_memory);
    EXPECT_EQ(context->memory().use().budget, std::uint64_t{64} << 20);
    g_claims.full.clear();
    expect_round_trip(*context);
}

TEST_F(MemoryTypes, WhatIsNotCachedIsReadThroughStaging) {
    for (const VkPhysicalDeviceType kind :
         {VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU, VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU}) {
        g_claims.kind = kind;
        g_claims.tried.clear();
        const auto context = open({kLocal | kCombined, kCached});
        EXPECT_FALSE(context->device().info().features.unified_memory);
        const Buffer buffer = test::device_buffer(*context, 100);
        EXPECT_EQ(Memory::host(buffer.range()), nullptr);
        expect_round_trip(*context);
        EXPECT_EQ(g_claims.tried, (Types{0, 1})) << "the staging buffer is cached";
    }
}

TEST_F(MemoryTypes, UnifiedMemoryIsCached) {
    const auto context = open({kLocal, kLocal | kCombined, kLocal | kCached});
    EXPECT_TRUE(context->device().info().features.unified_memory);
    EXPECT_EQ(context->memory().use().budget, std::uint64_t{1} << 30) << "all heaps are one memory";
    EXPECT_EQ(tried(*context, MemoryKind::kDevice, {2}), (Types{2, 1}));
    {
        const Buffer buffer = test::device_buffer(*context, 100);
        EXPECT_EQ(Memory::host(buffer.range()), nullptr) << "of the type that had room";
        expect_round_trip(*context);
    }
    g_claims.full.clear();
    const Buffer buffer = test::device_buffer(*context, 100);
    EXPECT_NE(Memory::host(buffer.range()), nullptr);
    expect_round_trip(*context);
}

TEST_F(MemoryTypes, TypesThatNeedAFeatureAreLeftOut) {
    const auto context = open({kLocal | kCached | VK_MEMORY_PROPERTY_DEVICE_COHERENT_BIT_AMD,
                               kLocal | VK_MEMORY_PROPERTY_PROTECTED_BIT, kLocal | kCached});
    EXPECT_EQ(tried(*context, MemoryKind::kDevice, {}), Types{2});
    EXPECT_EQ(tried(*context, MemoryKind::kDevice, {2}, false), Types{2});
}

}  // namespace
}  // namespace splat::vk

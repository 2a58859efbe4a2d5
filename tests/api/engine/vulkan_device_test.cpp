// Devices of the library on an application's Vulkan device: what they need, what they refuse, how they share it.
#include <thread>

#include "api/engine/application.h"

namespace splat::test {
namespace {

constexpr std::uint32_t kSide = 48;

/// A scene drawn in one call.
std::vector<std::uint8_t> drawn(splat_scene scene, splat_device device, double angle = 0) {
    std::vector<std::uint8_t> pixels(std::size_t{4} * kSide * kSide);
    const splat_camera camera = sample_camera(kSide, kSide, angle);
    const splat_image image = packed_image(pixels, kSide, kSide, 4);
    EXPECT_DONE(splat_scene_render(scene, device, &camera, 1, nullptr, &image));
    return pixels;
}

TEST(VulkanDevice, DrawsAsTheLibrarysOwn) {
    const Scene scene = SampleScene(200).create();
    const std::vector<std::uint8_t> expected = drawn(scene, open_device());
    Application app;
    {
        const Scene same = SampleScene(200).create();  // a copy of it keeps the device open
        const Device device = app.open();
        EXPECT_EQ(drawn(same, device), expected);
        EXPECT_EQ(got(splat_device_get_info, device.get()).vulkan_version, VK_API_VERSION_1_2);
    }
    EXPECT_GT(app.locks.load(), 0);
}

TEST(VulkanDevice, UsesOnlyWhatIsEnabled) {
    Application app({.int64 = false});
    const Device device = app.open();
    const splat_device_info info = got(splat_device_get_info, device.get());
    EXPECT_EQ(info.features & (SPLAT_FEATURE_INT64 | SPLAT_FEATURE_EXTERNAL_MEMORY), 0U);
    EXPECT_NE(info.kernels, SPLAT_KERNELS_CPU);
    const Scene scene = SampleScene(20).create();
    EXPECT_NE(drawn(scene, device), std::vector<std::uint8_t>(std::size_t{4} * kSide * kSide));
}

TEST(VulkanDevice, ListsAllThatIsMissing) {
    Application app({.api_version = VK_API_VERSION_1_1});
    splat_vulkan_desc desc = app.desc();
    const VkPhysicalDeviceFeatures2 nothing{
        VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, nullptr, {}};
    desc.features = &nothing;
    Device device;
    const splat_result result = splat_device_from_vulkan(&desc, nullptr, device.out());
    EXPECT_TRUE(
        refused(result, kUnsupported, "Vulkan 1.2 of the instance (its apiVersion is 1.1)"));
    EXPECT_TRUE(refused(result, kUnsupported, "the feature timelineSemaphore"));
    EXPECT_EQ(device.get(), nullptr);
    EXPECT_EQ(app.locks.load(), 0);
}

TEST(VulkanDevice, NeedsTimelineSemaphores) {
    Application app({.timeline = false});
    const splat_vulkan_desc desc = app.desc();
    Device device;
    EXPECT_REFUSED(splat_device_from_vulkan(&desc, nullptr, device.out()), kUnsupported,
                   "needs: the feature timelineSemaphore: enable it");
}

TEST(VulkanDevice, RefusesWrongHandles) {
    Application app, other;
    Device device;
    const auto wrong = [&](const char* part, const auto& change) {
        splat_vulkan_desc desc = app.desc();
        change(desc);
        EXPECT_REFUSED(splat_device_from_vulkan(&desc, nullptr, device.out()), kArgument, part);
    };
    using Desc = splat_vulkan_desc;
    wrong("get_instance_proc_addr is NULL", [](Desc& d) { d.get_instance_proc_addr = nullptr; });
    wrong("instance is NULL", [](Desc& d) { d.instance = nullptr; });
    wrong("physical_device is NULL", [](Desc& d) { d.physical_device = nullptr; });
    wrong("device is NULL", [](Desc& d) { d.device = nullptr; });
    wrong("queue is NULL", [](Desc& d) { d.queue = nullptr; });
    wrong("features is NULL", [](Desc& d) { d.features = nullptr; });
    wrong("none of the", [&](Desc& d) { d.physical_device = app.device; });
    wrong("the same handle", [](Desc& d) { d.queue = d.device; });
    wrong("the same handle", [](Desc& d) { d.device = d.physical_device; });
    wrong("queue_family is 99, expected less than", [](Desc& d) { d.queue_family = 99; });
    wrong("unlock_queue is NULL", [](Desc& d) { d.unlock_queue = nullptr; });
    wrong("lock_queue is NULL", [](Desc& d) { d.lock_queue = nullptr; });
    wrong("extensions is NULL", [](Desc& d) { d.extension_count = 1; });
    wrong("extension_count is 4294967295", [](Desc& d) { d.extension_count = UINT32_MAX; });
    const char* const names[] = {"VK_KHR_a", nullptr};
    wrong("extensions[1] is NULL", [&](Desc& d) { d.extensions = names, d.extension_count = 2; });
    VkPhysicalDeviceFeatures2 endless{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, nullptr, {}};
    endless.pNext = &endless;
    wrong("a chain of more than", [&](Desc& d) { d.features = &endless; });
    const auto wrong_desc = [&](const char* part, const auto& change) {
        const splat_vulkan_desc desc = app.desc();
        splat_device_desc more = device_desc();
        change(more);
        EXPECT_REFUSED(splat_device_from_vulkan(&desc, &more, device.out()), kArgument, part);
    };
    using More = splat_device_desc;
    wrong_desc("select is 1", [](More& d) { d.select = SPLAT_SELECT_BY_INDEX; });
    wrong_desc("index is 1", [](More& d) { d.index = 1; });
    wrong_desc("kind is 2", [](More& d) { d.kind = SPLAT_DEVICE_KIND_CPU; });
    wrong_desc("uuid is 7", [](More& d) { d.uuid[15] = 7; });
    wrong_desc("unknown bits", [](More& d) { d.flags = SPLAT_DEVICE_VALIDATION; });
    EXPECT_EQ(device.get(), nullptr);
}

TEST(VulkanDevice, RequirementsNeedAPlaceForFeatures) {
    Application app;
    splat_vulkan_requirements needs = app.requirements();
    VkPhysicalDeviceFeatures2 alone{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, nullptr, {}};
    needs.features = &alone;
    EXPECT_REFUSED(splat_device_requirements(&needs), kArgument, "a member timelineSemaphore");
    VkPhysicalDeviceTimelineSemaphoreFeatures timeline{};
    timeline.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_TIMELINE_SEMAPHORE_FEATURES;
    needs.features = &timeline;
    EXPECT_REFUSED(splat_device_requirements(&needs), kArgument,
                   "without VkPhysicalDeviceFeatures2");
    EXPECT_EQ(timeline.timelineSemaphore, VK_FALSE);
    alone.pNext = &timeline;
    needs.features = &alone;
    EXPECT_DONE(splat_device_requirements(&needs));
    EXPECT_EQ(timeline.timelineSemaphore, VK_TRUE);
    EXPECT_EQ(alone.features.shaderFloat64, VK_FALSE);
    needs.physical_device = app.device;
    EXPECT_REFUSED(splat_device_requirements(&needs), kArgument, "none of the");
    needs.reserved = 1;
    EXPECT_REFUSED(splat_device_requirements(&needs), kArgument, "reserved");
}

TEST(VulkanDevice, TwoShareAQueueWithTheApplication) {
    Application app;
    const Device first = app.open(), second = app.open();
    const Scene scene = SampleScene(100).create();
    std::vector<std::uint8_t> expected[2];
    for (int i = 0; i < 2; ++i) expected[i] = drawn(scene, first, i);
    std::atomic<bool> done{false};
    std::thread busy([&] {
        while (!done) app.submit_nothing();
    });
    std::vector<std::thread> threads;
    for (int i = 0; i < 2; ++i)
        threads.emplace_back([&, i] {
            for (int turn = 0; turn < 5; ++turn)
                EXPECT_EQ(drawn(scene, i == 0 ? first : second, i), expected[i]);
        });
    for (std::thread& thread : threads) thread.join();
    done = true;
    busy.join();
    EXPECT_GE(app.locks.load(), 12);
}

}  // namespace
}  // namespace splat::test

// Tests that must fail: ctest expects the harness's message.
#include <gtest/gtest.h>

#include <utility>

#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "support/require_vulkan.h"
#include "test_shaders.h"

namespace splat::vk {
namespace {

TEST(Harness, DISABLED_MessageFailsTheTest) {
    Context* context = test::shared_context();
    const Buffer a = test::device_buffer(*context, 64);
    const Buffer b = test::device_buffer(*context, 64);
    Recorder recorder(*context);
    recorder.omit_barriers = true;
    EXPECT_OK(recorder.fill(a.range(), 0));
    EXPECT_OK(recorder.copy(a.range(), b.range()));
    CommandList list = need(recorder.finish());
    EXPECT_OK(context->run(list));
}

TEST(Harness, DISABLED_BrokenGuardFailsTheTest) {
    Context* context = test::poisoned_context(Kernels::kAuto, 0);  // shared, with guards
    ASSERT_NE(context, nullptr);
    const Buffer buffer = test::device_buffer(*context, 64);
    std::byte* host = Memory::host(buffer.range());
    ASSERT_NE(host, nullptr);
    host[-1] = ~host[-1];
}

TEST(Harness, DISABLED_MissingPartFailsTheTest) {
    SPLAT_SKIP_FOR_DEVICE("this device has no "
                          << "timestamps");
}

TEST(Harness, ExpectedMessagesDoNotFailTheTest) {
    if (!test::validation_on()) GTEST_SKIP() << "validation is off";
    Context* context = test::shared_context();
    const Buffer a = test::device_buffer(*context, 64);
    Recorder recorder(*context);
    recorder.omit_barriers = true;
    EXPECT_OK(recorder.fill(a.range(), 0));
    EXPECT_OK(recorder.fill(a.range(), 1));
    CommandList list = need(recorder.finish());
    const test::ExpectedMessages bait;
    EXPECT_OK(context->run(list));
    EXPECT_GT(bait.count(), 0U);
}

/// Send a message as the layer does.
void submit(const Instance& instance, VkDebugUtilsMessageSeverityFlagBitsEXT severity,
            const char* id, const char* text) {
    const auto send = reinterpret_cast<PFN_vkSubmitDebugUtilsMessageEXT>(
        vkGetInstanceProcAddr(instance.handle(), "vkSubmitDebugUtilsMessageEXT"));
    ASSERT_NE(send, nullptr);
    VkDebugUtilsMessengerCallbackDataEXT data{};
    data.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CALLBACK_DATA_EXT;
    data.pMessageIdName = id;
    data.pMessage = text;
    send(instance.handle(), severity, VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT, &data);
}

TEST(Harness, WarningsOfTheLayerOnItselfDoNotCount) {
    if (!test::validation_on()) GTEST_SKIP() << "validation is off";
    const auto instance = need(Instance::get(true));
    constexpr auto kWarning = VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT;
    const std::pair<const char*, const char*> own[] = {
        {"VALIDATION-SETTINGS",
         "vkCreateInstance(): Both GPU Assisted Validation and Normal Core Check Validation are "
         "enabled, this is not recommend as it  will be very slow."},
        {"WARNING-GPU-Assisted-Validation",
         "vkCreateDevice(): Internal Warning: Adding a VkPhysicalDeviceTimelineSemaphoreFeatures "
         "to pNext with timelineSemaphore set to VK_TRUE"},
        {"WARNING-GPU-Assisted-Validation",
         "vkCreateDevice(): Internal Warning: Forcing shaderInt64 to VK_TRUE"},
    };
    const test::ExpectedMessages expected;
    for (const auto& [id, text] : own) {
        submit(*instance, kWarning, id, text);
        EXPECT_EQ(expected.count(), 0U) << text;
    }
    std::uint64_t before = 0;
    const auto expect_counted = [&](const char* what) {
        EXPECT_GT(expected.count(), before) << what;
        before = expected.count();
    };
    for (const auto& [id, text] : own) {
        submit(*instance, VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT, id, text);
        expect_counted("an error");
        submit(*instance, kWarning, "VUID-vkCreateDevice-pNext-00373", text);
        expect_counted("another id");
        submit(*instance, kWarning, id, "The layer gives up.");
        expect_counted("another text");
        submit(*instance, kWarning, nullptr, text);
        expect_counted("no id");
    }
}

}  // namespace
}  // namespace splat::vk

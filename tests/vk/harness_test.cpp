// Tests that must fail: ctest expects the harness's message.
#include <gtest/gtest.h>

#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "support/require_vulkan.h"
#include "test_shaders.h"

namespace splat::vk {
namespace {

TEST(Harness, DISABLED_MessageFailsTheTest) {
    Context* context = test::shared_context();
    ASSERT_NE(context, nullptr);
    const Buffer a = test::device_buffer(*context, 64);
    const Buffer b = test::device_buffer(*context, 64);
    Recorder recorder(*context);
    recorder.omit_barriers = true;
    EXPECT_OK(recorder.fill(a.range(), 0));
    EXPECT_OK(recorder.copy(a.range(), b.range()));
    CommandList list = std::move(recorder.finish().value());
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
    ASSERT_NE(context, nullptr);
    const Buffer a = test::device_buffer(*context, 64);
    Recorder recorder(*context);
    recorder.omit_barriers = true;
    EXPECT_OK(recorder.fill(a.range(), 0));
    EXPECT_OK(recorder.fill(a.range(), 1));
    CommandList list = std::move(recorder.finish().value());
    const test::ExpectedMessages bait;
    EXPECT_OK(context->run(list));
    EXPECT_GT(bait.count(), 0U);
}

}  // namespace
}  // namespace splat::vk

#include "vk/device_exit.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "support/system.h"

namespace splat::vk {
namespace {

/// A global object of a program.
struct Global {
    ~Global() {
        if (!devices_ended_at_exit()) std::_Exit(3);
        if (context->fill(buffer.range(), 1).code() != Code::kDeviceLost) std::_Exit(4);
        if (context->memory().allocate(64, MemoryKind::kDevice, "x").status().code() !=
            Code::kDeviceLost)
            std::_Exit(5);
        buffer = Buffer();
        context.reset();
        if (validation_messages() != messages) std::_Exit(6);
    }
    std::shared_ptr<Context> context;
    Buffer buffer;
    std::uint64_t messages = 0;
};

TEST(DeviceExit, GlobalObjectsMayBeDestroyedAfterTheLayer) {
    if (!test::validation_on()) GTEST_SKIP() << "validation is off";
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    test::set_variable("LSAN_OPTIONS", "detect_leaks=0");  // it ends without freeing its memory
    const auto exit_with_a_device = [] {
        static Global global;
        global.context = test::make_context();
        global.buffer = test::device_buffer(*global.context, 64);
        global.messages = validation_messages();
        end_devices_before(
            VK_MAKE_API_VERSION(0, 1, 4, 305));  // belongs to a defective layer, whatever is here
        std::exit(0);
    };
    EXPECT_EXIT(exit_with_a_device(), testing::ExitedWithCode(0), "");
}

TEST(DeviceExit, OtherLayersNeedNothing) {
    if (!test::validation_on()) GTEST_SKIP() << "validation is off";
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    const auto exit_at_once = [] {
        std::atexit([] { std::_Exit(devices_ended_at_exit() ? 3 : 0); });
        end_devices_before(VK_MAKE_API_VERSION(0, 1, 4, 304));
        std::exit(0);
    };
    EXPECT_EXIT(exit_at_once(), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace splat::vk

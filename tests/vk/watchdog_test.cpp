#include "vk/watchdog.h"

#include <gtest/gtest.h>

#include "support/expect_status.h"

namespace splat::vk {
namespace {

using namespace std::chrono_literals;

TEST(Watchdog, TellsOfACallThatDoesNotReturn) {
    testing::internal::CaptureStderr();
    {
        const Watchdog watchdog("a GPU (a driver)", "the compilation of", "blend_forward", 1ms);
        std::this_thread::sleep_for(200ms);
    }
    EXPECT_HAS(testing::internal::GetCapturedStderr(),
               "libsplat: a GPU (a driver): the compilation of blend_forward has not returned for "
               "0.001 s. ");
}

TEST(Watchdog, SaysNothingOfOneThatDoes) {
    testing::internal::CaptureStderr();
    { const Watchdog watchdog("", "the opening of a device", ""); }
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

}  // namespace
}  // namespace splat::vk

// What a log callback may do, and what replacing it waits for.
#include <atomic>
#include <functional>
#include <thread>

#include "api/api_calls.h"

namespace splat::test {
namespace {

/// Calls a function for every message.
struct Listener {
    std::function<void(splat_log_level, const std::string&)> hear;
    static void call(void* user, splat_log_level level, const char* message) {
        static_cast<Listener*>(user)->hear(level, message);
    }
};

class ApiLogCallback : public testing::Test {
  protected:
    void TearDown() override { listen_to_log(); }
    void listen(splat_log_level level,
                std::function<void(splat_log_level, const std::string&)> hear) {
        listener_.hear = std::move(hear);
        ASSERT_DONE(splat_log_set_callback(Listener::call, &listener_, level));
    }
    Listener listener_;
};

TEST_F(ApiLogCallback, MayDestroyAndFail) {
    const splat_device device = shared_device();
    Tensor tensor = make_tensor(device, {1, 4});
    Op op = make_op(device, OpRequest("silu", {tensor}, {make_tensor(device, {1, 4})}));
    int messages = 0;
    listen(SPLAT_LOG_DEBUG, [&](splat_log_level, const std::string&) {
        ++messages;
        op.destroy();
        tensor.destroy();
        EXPECT_EQ(splat_tensor_unmap(nullptr), kHandle);
        auto memory = sized<splat_memory_info>();
        EXPECT_EQ(splat_device_get_memory(device, &memory), SPLAT_OK);
    });
    EXPECT_REFUSED(splat_tensor_unmap(tensor), kState, "not mapped");
    EXPECT_EQ(messages, 1) << "a message that the callback causes is not heard";
}

TEST_F(ApiLogCallback, LeavesTheLastErrorOfTheCall) {
    listen(SPLAT_LOG_DEBUG, [](splat_log_level, const std::string&) {
        auto info = sized<splat_tensor_info>();
        EXPECT_EQ(splat_tensor_get_info(nullptr, &info), kHandle);
    });
    EXPECT_EQ(splat_device_describe(1U << 20, nullptr), kArgument);
    EXPECT_TRUE(holds(splat_last_error_message(), "info is NULL"));
}

/// Errors arise while a call holds the locks of a device and of a scene.
TEST_F(ApiLogCallback, MayUseTheObjectsOfTheFailingCall) {
    const Device device = open_device();
    Tensor tensor = make_tensor(device, {4});
    mapped(tensor, SPLAT_ACCESS_READ);
    int messages = 0;
    listen(SPLAT_LOG_DEBUG, [&](splat_log_level, const std::string&) {
        ++messages;
        EXPECT_EQ(splat_tensor_unmap(tensor), SPLAT_OK);  // takes the device's lock
    });
    float values[4] = {};
    EXPECT_EQ(splat_tensor_read(tensor, values, sizeof values, nullptr), kState);
    EXPECT_EQ(messages, 1);
    EXPECT_DONE(splat_tensor_read(tensor, values, sizeof values, nullptr));
}

TEST_F(ApiLogCallback, MayReplaceItself) {
    int first = 0;
    static int second;
    second = 0;
    listen(SPLAT_LOG_DEBUG, [&](splat_log_level, const std::string&) {
        ++first;
        EXPECT_DONE(splat_log_set_callback([](void*, splat_log_level, const char*) { ++second; },
                                           nullptr, SPLAT_LOG_DEBUG));
    });
    EXPECT_EQ(splat_tensor_unmap(nullptr), kHandle);
    EXPECT_EQ(splat_tensor_unmap(nullptr), kHandle);
    EXPECT_EQ(first, 1);
    EXPECT_EQ(second, 1);
}

TEST_F(ApiLogCallback, ReplacingWaitsForTheOneThatRuns) {
    std::atomic<bool> inside = false, may_end = false, ended = false, replaced = false;
    listen(SPLAT_LOG_DEBUG, [&](splat_log_level, const std::string&) {
        inside = true;
        while (!may_end) std::this_thread::yield();
        ended = true;
    });
    std::jthread failing([] { EXPECT_EQ(splat_tensor_unmap(nullptr), kHandle); });
    while (!inside) std::this_thread::yield();
    std::jthread replacing([&] {
        EXPECT_EQ(splat_log_set_callback(nullptr, nullptr, 0), SPLAT_OK);
        EXPECT_TRUE(ended) << "the old callback's data may be freed now";
        replaced = true;
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    EXPECT_FALSE(replaced);
    may_end = true;
    failing.join();
    replacing.join();
}

}  // namespace
}  // namespace splat::test

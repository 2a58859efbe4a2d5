// Destroying and describing objects beside a long call of another thread on their device.
#include <cstdio>

#include "api/concurrent/long_call.h"
#include "api/raster_calls.h"

namespace splat::test {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kMostMs = 10;  // times SPLAT_TIMEOUT_SCALE

/// Times calls and remembers the slowest.
struct Stopwatch {
    template <class Call>
    void time(const char* name, Call&& call) {
        const auto begin = Clock::now();
        const splat_result result = call();
        const double ms = milliseconds_since(begin);
        EXPECT_TRUE(result == SPLAT_OK || result == SPLAT_INCOMPLETE) << splat_last_error_message();
        EXPECT_LE(ms, kMostMs * timeout_scale()) << name;
        std::printf("%-32s %8.3f ms\n", name, ms);
    }
};

/// One object of every kind that a device has, each used once.
struct Objects {
    explicit Objects(const Device& device)
        : tensor(make_tensor(device, {64, 64})),
          request("silu", {tensor}, {result = make_tensor(device, {64, 64})}),
          op(make_op(device, request)),
          scene(SampleScene(100).create()),
          rasterizer(make_rasterizer(device, rasterizer_desc(100, 32, 32))),
          model(make_model(device)),
          module(make_module(device)),
          trainer(make_trainer(device)) {
        const splat_camera camera = sample_camera(32, 32);
        EXPECT_DONE(
            splat_rasterizer_forward_scene(rasterizer, nullptr, scene, &camera, 1, nullptr));
        EXPECT_DONE(splat_op_forward(op));
    }

    Tensor tensor, result;
    OpRequest request;
    Op op;
    Scene scene;
    Rasterizer rasterizer;
    Model model;
    Module module;
    Trainer trainer;
};

TEST(ApiWait, DescribingAndDestroyingDoNotWaitForACall) {
    splat_device_desc desc = device_desc(SPLAT_DEVICE_PROFILE);
    desc.kernels = SPLAT_KERNELS_PLAIN;
    Device device = open_device(desc);
    Objects objects(device);
    LongCall call(device, 2000);
    call.begin();
    Stopwatch watch;
    auto memory = sized<splat_memory_info>();
    const auto text = [](auto function, auto handle) {
        return [function, handle] { return function(handle, nullptr, 0, nullptr); };
    };
    const auto info = [](auto function, auto handle, auto& filled) {
        return [function, handle, &filled] { return function(handle, &filled); };
    };
    auto device_info = sized<splat_device_info>();
    auto tensor_info = sized<splat_tensor_info>();
    auto scene_info = sized<splat_scene_info>();
    auto rasterizer_info = sized<splat_rasterizer_info>();
    const splat_device d = device;
    watch.time("splat_device_get_info", info(splat_device_get_info, d, device_info));
    watch.time("splat_device_get_memory", info(splat_device_get_memory, d, memory));
    watch.time("splat_device_profile_json", text(splat_device_profile_json, d));
    watch.time("splat_device_profile_table", text(splat_device_profile_table, d));
    watch.time("splat_device_profile_reset", [d] { return splat_device_profile_reset(d); });
    watch.time("splat_tensor_get_info",
               info(splat_tensor_get_info, objects.tensor.get(), tensor_info));
    watch.time("splat_scene_get_info", info(splat_scene_get_info, objects.scene.get(), scene_info));
    watch.time("splat_rasterizer_get_info", [&] {
        return splat_rasterizer_get_info(objects.rasterizer, nullptr, &rasterizer_info);
    });
    watch.time("splat_model_report", text(splat_model_report, objects.model.get()));
    watch.time("splat_module_report", text(splat_module_report, objects.module.get()));
    watch.time("splat_trainer_report", text(splat_trainer_report, objects.trainer.get()));
    EXPECT_GT(rasterizer_info.passes, 0U) << "of the call before";

    const auto end = [&watch](const char* name, auto& owned) {
        watch.time(name, [&owned] { return owned.destroy(), SPLAT_OK; });
    };
    end("splat_op_destroy", objects.op);
    end("splat_tensor_destroy", objects.tensor);
    end("splat_scene_destroy", objects.scene);
    end("splat_rasterizer_destroy", objects.rasterizer);
    end("splat_model_destroy", objects.model);
    end("splat_module_destroy", objects.module);
    end("splat_trainer_destroy", objects.trainer);
    auto beside = sized<splat_memory_info>();
    EXPECT_DONE(splat_device_get_memory(device, &beside));
    ASSERT_TRUE(call.running()) << "the call was too short to measure beside it";
    EXPECT_EQ(call.finish(), SPLAT_OK);
    auto after = sized<splat_memory_info>();
    EXPECT_DONE(splat_device_get_memory(device, &after));
    EXPECT_EQ(beside.live_bytes, memory.live_bytes) << "freed when the call ends";
    EXPECT_LT(after.live_bytes, beside.live_bytes);
    std::printf("beside a call of %.0f ms\n", call.measured_ms());
}

TEST(ApiWait, DestroyingTheDeviceDoesNotWaitForACall) {
    Device device = open_device();
    LongCall call(device, 500);
    call.begin();
    Stopwatch().time("splat_device_destroy", [&] { return device.destroy(), SPLAT_OK; });
    ASSERT_TRUE(call.running());
    EXPECT_EQ(call.finish(), SPLAT_OK);
}

/// A rasterizer that waits for the device holds no lock of the scene.
TEST(ApiWait, ScenesAreFreeWhileARasterizerWaits) {
    const Device device = open_device();
    const Scene scene = SampleScene(100).create();
    const Rasterizer rasterizer = make_rasterizer(device, rasterizer_desc(100, 32, 32));
    LongCall call(device, 1000);
    call.begin();
    std::jthread drawing([&] {
        const splat_camera camera = sample_camera(32, 32);
        EXPECT_DONE(
            splat_rasterizer_forward_scene(rasterizer, nullptr, scene, &camera, 1, nullptr));
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    Stopwatch watch;
    auto info = sized<splat_scene_info>();
    watch.time("splat_scene_get_info", [&] { return splat_scene_get_info(scene, &info); });
    ASSERT_TRUE(call.running());
    drawing.join();
}

}  // namespace
}  // namespace splat::test

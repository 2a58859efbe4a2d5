// Cancelling the calls on a device.
#include <algorithm>
#include <csignal>
#include <cstdio>

#include "api/concurrent/long_call.h"
#include "api/raster_calls.h"

namespace splat::test {
namespace {

TEST(ApiCancel, EndsTheCallThatRunsAndThoseThatWait) {
    const Device device = open_device();
    LongCall call(device, 500);
    Tensor tensor = upload(device, {4}, {1, 2, 3, 4});
    call.begin();
    std::atomic<int> begun = 0;
    std::vector<std::jthread> waiting;
    for (int i = 0; i < 3; ++i)
        waiting.emplace_back([&] {
            float values[4] = {-1, -1, -1, -1};
            ++begun;
            EXPECT_REFUSED(splat_tensor_read(tensor, values, sizeof values, nullptr),
                           SPLAT_CANCELLED, "splat_device_cancel");
            EXPECT_EQ(values[0], -1) << "outputs untouched";
        });
    while (begun < 3) std::this_thread::yield();
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    ASSERT_TRUE(call.running());
    EXPECT_DONE(splat_device_cancel(device));
    EXPECT_EQ(call.finish(), SPLAT_CANCELLED);
    for (std::jthread& thread : waiting) thread.join();
    EXPECT_EQ(download(tensor), (Floats{1, 2, 3, 4})) << "later calls work";
    EXPECT_DONE(splat_op_forward(call.op()));
}

TEST(ApiCancel, OfAnIdleDeviceChangesNothing) {
    const Device device = open_device();
    const Tensor tensor = upload(device, {2}, {1, 2});
    EXPECT_DONE(splat_device_cancel(device));
    EXPECT_EQ(download(tensor), (Floats{1, 2}));
}

TEST(ApiCancel, OfADeviceLeavesOthersAlone) {
    const Device device = open_device(), other = open_device();
    LongCall call(device, 200);
    call.begin();
    EXPECT_DONE(splat_device_cancel(other));
    EXPECT_EQ(call.finish(), SPLAT_OK);
}

TEST(ApiCancel, WorksFromASignalHandler) {
    const Device device = open_device();
    LongCall call(device, 300);
    static splat_device handled;
    handled = device;
    const auto before =
        std::signal(SIGTERM, [](int) { static_cast<void>(splat_device_cancel(handled)); });
    call.begin();
    ASSERT_EQ(std::raise(SIGTERM), 0);
    EXPECT_EQ(call.finish(), SPLAT_CANCELLED);
    std::signal(SIGTERM, before);
}

/// The published network: a pass of seconds, of which the device gets a few hundredths at a time.
TEST(ApiCancelNetwork, EndsAPassSoon) {
    using Clock = std::chrono::steady_clock;
    constexpr double kMostMs = 1500;
    constexpr double kLeastPassMs =
        500;  // a quarter of it is longer than a thread waits for a core
    const Device device = open_device();
    auto desc = sized<splat_model_desc>();
    const Model model = got(splat_model_create, device, &desc);
    ASSERT_DONE(splat_model_init(model, 3));
    constexpr std::size_t kSide = 128;
    Floats images(3 * kSide * kSide), opacities(kSide * kSide);
    for (std::size_t i = 0; i < images.size(); ++i) images[i] = static_cast<float>(i % 251) / 251;
    auto input = sized<splat_model_input>();
    input.images = images.data();
    const auto forward = [&] { return splat_model_forward(model, &input); };
    const auto result = [&] {
        EXPECT_DONE(splat_model_read(model, "opacities", opacities.data(),
                                     opacities.size() * sizeof(float)));
        return opacities;
    };
    ASSERT_DONE(forward());  // compiles its shaders
    const Floats expected = result();
    ASSERT_DONE(forward());  // prepares the weights
    const auto begin = Clock::now();
    ASSERT_DONE(forward());
    const double whole_ms = milliseconds_since(begin);
    if (whole_ms < kLeastPassMs)
        GTEST_SKIP() << "a pass takes this device " << whole_ms
                     << " ms, too short to cancel in its middle; the "
                        "software driver runs this test";
    for (const double part : {0.02, 0.2}) {
        Clock::time_point cancelled;
        std::jthread cancelling([&] {
            std::this_thread::sleep_for(std::chrono::duration<double, std::milli>(part * whole_ms));
            cancelled = Clock::now();
            EXPECT_DONE(splat_device_cancel(device));
        });
        EXPECT_REFUSED(forward(), SPLAT_CANCELLED, "splat_device_cancel");
        cancelling.join();
        const double ms = milliseconds_since(cancelled);
        std::printf("cancelled after %.0f of %.0f ms; the call ended %.0f ms later\n",
                    part * whole_ms, whole_ms, ms);
        EXPECT_LT(ms, std::min(kMostMs * timeout_scale(), whole_ms / 4));
    }
    ASSERT_DONE(forward());
    EXPECT_TRUE(same_bits(result(), expected));
}

/// Cancel again and again while `call` repeats; then it works as it did before.
template <class Call>
void expect_recovers(splat_device device, Call&& call) {
    ASSERT_DONE(call());
    std::atomic<bool> done = false;
    std::jthread cancelling([&] {
        while (!done) {
            EXPECT_EQ(splat_device_cancel(device), SPLAT_OK);
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
    });
    int cancelled = 0;
    for (int i = 0; i < 2000 && cancelled < 5; ++i) {
        const splat_result result = call();
        EXPECT_TRUE(result == SPLAT_OK || result == SPLAT_CANCELLED) << splat_last_error_message();
        cancelled += result == SPLAT_CANCELLED ? 1 : 0;
    }
    done = true;
    cancelling.join();
    EXPECT_GT(cancelled, 0);
    EXPECT_DONE(call());
}

TEST(ApiCancel, RasterizersGoOn) {
    const Device device = open_device();
    constexpr std::uint32_t kSide = 256, kCount = 5000;
    const Scene scene = SampleScene(kCount).create();
    const Rasterizer rasterizer = make_rasterizer(device, rasterizer_desc(kCount, kSide, kSide));
    const auto draw = [&](double angle) {
        return test::draw(rasterizer, scene, sample_camera(kSide, kSide, angle));
    };
    ASSERT_DONE(draw(0));
    const Floats expected = output(rasterizer, SPLAT_OUTPUT_RGB, kSide * kSide * 3);
    double angle = 0;
    expect_recovers(device, [&] { return draw(angle += 0.01); });
    ASSERT_DONE(draw(0));
    EXPECT_TRUE(same_bits(output(rasterizer, SPLAT_OUTPUT_RGB, kSide * kSide * 3), expected));
}

TEST(ApiCancel, TrainersGoOnAsIfNothingHadHappened) {
    const Device device = open_device();
    const TrainerBatch images;
    const splat_trainer_batch batch = images.desc();
    const Trainer straight = make_trainer(device), cancelled = make_trainer(device);
    auto info = sized<splat_trainer_info>();
    std::uint64_t steps = 0;
    expect_recovers(device, [&] {
        const splat_result result = splat_trainer_step(cancelled, &batch, &info);
        steps += result == SPLAT_OK ? 1 : 0;
        return result;
    });
    EXPECT_EQ(info.step, steps);
    auto expected = sized<splat_trainer_info>();
    for (std::uint64_t i = 0; i < steps; ++i) expected = got(splat_trainer_step, straight, batch);
    EXPECT_EQ(info.loss, expected.loss) << "bit by bit";
}

}  // namespace
}  // namespace splat::test

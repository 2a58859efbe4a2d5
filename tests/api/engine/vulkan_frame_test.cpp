// Frames that the library draws into an application's images and buffers without waiting.
#include <algorithm>
#include <bit>
#include <cmath>
#include <thread>

#include "api/engine/application.h"

namespace splat::test {
namespace {

constexpr std::uint32_t kWidth = 50, kHeight = 40, kCount = 300;
constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight;

class VulkanFrame : public testing::Test {
  protected:
    splat_vulkan_target image_target(VkImage image, VkImageLayout layout) const {
        auto target = sized<splat_vulkan_target>();
        target.image = std::bit_cast<std::uint64_t>(image);
        target.format = VK_FORMAT_R8G8B8A8_UNORM;
        target.layout = static_cast<std::uint32_t>(layout);
        return target;
    }
    splat_vulkan_target buffer_target(VkBuffer buffer, VkFormat format, std::uint64_t bytes) const {
        auto target = sized<splat_vulkan_target>();
        target.buffer = std::bit_cast<std::uint64_t>(buffer);
        target.format = static_cast<std::uint32_t>(format);
        target.bytes = bytes;
        return target;
    }
    splat_vulkan_frame submit(const splat_camera& camera, const splat_vulkan_target& target) {
        auto frame = sized<splat_vulkan_frame>();
        EXPECT_DONE(splat_rasterizer_submit(rasterizer_, nullptr, scene_, &camera, background_,
                                            &target, &frame));
        return frame;
    }
    /// What a rasterizer that waits draws, in bytes.
    std::vector<std::uint8_t> expected(const splat_camera& camera) {
        EXPECT_DONE(draw(waiting_, scene_, camera, background_));
        std::vector<std::uint8_t> pixels(4 * kPixels);
        const splat_image image = packed_image(pixels, kWidth, kHeight, 4);
        EXPECT_DONE(
            splat_rasterizer_read_images(waiting_, nullptr, SPLAT_OUTPUT_RGB, 0, &image, 1));
        return pixels;
    }
    static std::vector<std::uint8_t> bytes(const std::byte* host) {
        const auto* from = reinterpret_cast<const std::uint8_t*>(host);
        return {from, from + 4 * kPixels};
    }

    // Last the scene: its copies on devices end with it.
    Application app_;
    Device device_ = app_.open();
    Scene scene_ = SampleScene(kCount).create();
    Rasterizer rasterizer_ = make_rasterizer(device_, rasterizer_desc(kCount, kWidth, kHeight));
    Rasterizer waiting_ = make_rasterizer(device_, rasterizer_desc(kCount, kWidth, kHeight));
    float background_[3] = {0.2F, 0.4F, 0.6F};
};

TEST_F(VulkanFrame, ImagesAreThoseOfCallsThatWait) {
    std::vector<splat_camera> cameras;
    for (int i = 0; i < 4; ++i) cameras.push_back(sample_camera(kWidth, kHeight, 0.1 * i));
    const VkImage image = app_.make_image(kWidth, kHeight, VK_FORMAT_R8G8B8A8_UNORM);
    std::vector<const std::byte*> copies;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        const auto target = image_target(
            image, i % 2 == 0 ? VK_IMAGE_LAYOUT_GENERAL : VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL);
        const splat_vulkan_frame frame = submit(cameras[i], target);
        EXPECT_EQ(frame.value, i + 1);
        EXPECT_EQ(frame.waited, i == 0 ? 1U : 0U);
        EXPECT_EQ(frame.lost, 0U);
        copies.push_back(app_.copy(image, target, frame, kWidth, kHeight));
    }
    app_.idle();
    for (std::size_t i = 0; i < cameras.size(); ++i)
        EXPECT_EQ(bytes(copies[i]), expected(cameras[i])) << i;
}

TEST_F(VulkanFrame, BuffersTakeEveryFormat) {
    const splat_camera camera = sample_camera(kWidth, kHeight, 0.2);
    constexpr std::uint64_t kOffset = 12, kRoom = 16 * kPixels + 64;
    std::byte* host = nullptr;
    const VkBuffer buffer = app_.make_buffer(kRoom, &host);
    const std::vector<std::uint8_t> as_bytes = expected(camera);
    const Floats rgb = output(waiting_, SPLAT_OUTPUT_RGB, 3 * kPixels);
    const Floats alpha = output(waiting_, SPLAT_OUTPUT_ALPHA, kPixels);
    const auto number = [&](std::size_t i) {
        return i % 4 == 3 ? alpha[i / 4] : rgb[i / 4 * 3 + i % 4];
    };
    const std::pair<VkFormat, std::size_t> formats[] = {{VK_FORMAT_R8G8B8A8_UNORM, 4},
                                                        {VK_FORMAT_R16G16B16A16_SFLOAT, 8},
                                                        {VK_FORMAT_R32G32B32A32_SFLOAT, 16}};
    for (const auto& [format, pixel] : formats) {
        std::fill_n(host, kRoom, std::byte{0xA5});
        splat_vulkan_target target = buffer_target(buffer, format, kRoom - kOffset);
        target.offset = kOffset;
        app_.wait(submit(camera, target));
        const std::byte *const begin = host, *const at = begin + kOffset;
        const auto untouched = [](std::byte byte) { return byte == std::byte{0xA5}; };
        EXPECT_TRUE(std::all_of(begin, at, untouched));
        EXPECT_TRUE(std::all_of(at + pixel * kPixels, begin + kRoom, untouched));
        for (std::size_t i = 0; i < 4 * kPixels; ++i) {
            if (pixel == 4) {
                ASSERT_EQ(std::to_integer<std::uint8_t>(at[i]), as_bytes[i]) << i;
            } else if (pixel == 16) {
                float value = 0;
                std::memcpy(&value, at + 4 * i, 4);
                ASSERT_EQ(value, number(i)) << i;
            } else {
                std::uint16_t half = 0;
                std::memcpy(&half, at + 2 * i, 2);
                const int exponent = half >> 10 & 31, rest = half & 1023;
                const float value =
                    exponent == 0 ? std::ldexp(static_cast<float>(rest), -24)
                                  : std::ldexp(static_cast<float>(1024 + rest), exponent - 25);
                ASSERT_NEAR(value, number(i), 1e-3F * (number(i) + 1e-3F)) << i;
            }
        }
    }
}

TEST_F(VulkanFrame, ThatNeedsMoreMemoryIsLostAndTold) {
    std::byte* host = nullptr;
    const VkBuffer buffer = app_.make_buffer(4 * kPixels, &host);
    const auto target = buffer_target(buffer, VK_FORMAT_R8G8B8A8_UNORM, 4 * kPixels);
    // 5000 Gaussians that are a few pixels wide from afar, and many tiles from near.
    const Scene scene = SampleScene(5000).create();
    const Rasterizer rasterizer = make_rasterizer(device_, rasterizer_desc(5000, kWidth, kHeight));
    splat_camera far = sample_camera(kWidth, kHeight), near = far;
    far.fx = far.fy = far.fx / 8;
    near.fx = near.fy = near.fx * 8;
    const auto draw_frame = [&](const splat_camera& camera) {
        auto frame = sized<splat_vulkan_frame>();
        EXPECT_DONE(
            splat_rasterizer_submit(rasterizer, nullptr, scene, &camera, nullptr, &target, &frame));
        app_.wait(frame);
        return frame;
    };
    EXPECT_EQ(draw_frame(far).waited, 1U);
    const splat_vulkan_frame lost = draw_frame(near);
    EXPECT_EQ(lost.waited, 0U);
    const splat_vulkan_frame after = draw_frame(near);
    if (after.lost == 0) GTEST_FAIL() << "the sample scene needs no more memory from near";
    EXPECT_EQ(after.lost, lost.value);
    EXPECT_EQ(after.waited, 1U);
    const Rasterizer waiting = make_rasterizer(device_, rasterizer_desc(5000, kWidth, kHeight));
    EXPECT_DONE(draw(waiting, scene, near));
    std::vector<std::uint8_t> pixels(4 * kPixels);
    const splat_image image = packed_image(pixels, kWidth, kHeight, 4);
    EXPECT_DONE(splat_rasterizer_read_images(waiting, nullptr, SPLAT_OUTPUT_RGB, 0, &image, 1));
    EXPECT_EQ(bytes(host), pixels);
    const splat_vulkan_frame good = draw_frame(near);
    EXPECT_EQ(good.lost, 0U);
    EXPECT_EQ(bytes(host), pixels);
}

TEST_F(VulkanFrame, WaitsForTheApplicationsSemaphore) {
    std::byte* host = nullptr;
    const VkBuffer buffer = app_.make_buffer(4 * kPixels, &host);
    const splat_camera camera = sample_camera(kWidth, kHeight);
    auto target = buffer_target(buffer, VK_FORMAT_R8G8B8A8_UNORM, 4 * kPixels);
    app_.wait(submit(camera, target));
    const VkSemaphore semaphore = app_.make_timeline();
    target.wait_semaphore = std::bit_cast<std::uint64_t>(semaphore);
    target.wait_value = 7;
    std::fill_n(host, 4 * kPixels, std::byte{0});
    const splat_vulkan_frame frame = submit(sample_camera(kWidth, kHeight, 0.3), target);
    std::uint64_t reached = 0;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    ASSERT_EQ(vkGetSemaphoreCounterValue(app_.device, std::bit_cast<VkSemaphore>(frame.semaphore),
                                         &reached),
              VK_SUCCESS);
    EXPECT_EQ(reached, frame.value - 1);
    EXPECT_EQ(bytes(host), std::vector<std::uint8_t>(4 * kPixels));
    VkSemaphoreSignalInfo signal{};
    signal.sType = VK_STRUCTURE_TYPE_SEMAPHORE_SIGNAL_INFO;
    signal.semaphore = semaphore;
    signal.value = 7;
    ASSERT_EQ(vkSignalSemaphore(app_.device, &signal), VK_SUCCESS);
    app_.wait(frame);
    EXPECT_EQ(bytes(host), expected(sample_camera(kWidth, kHeight, 0.3)));
}

TEST_F(VulkanFrame, AnyCallMayFollow) {
    std::byte* host = nullptr;
    const VkBuffer buffer = app_.make_buffer(4 * kPixels, &host);
    const auto target = buffer_target(buffer, VK_FORMAT_R8G8B8A8_UNORM, 4 * kPixels);
    for (int i = 0; i < 3; ++i) {
        const splat_camera camera = sample_camera(kWidth, kHeight, 0.2 * i);
        submit(camera, target);
        // Outputs are the frame's.
        std::vector<std::uint8_t> pixels(4 * kPixels);
        const splat_image image = packed_image(pixels, kWidth, kHeight, 4);
        EXPECT_DONE(
            splat_rasterizer_read_images(rasterizer_, nullptr, SPLAT_OUTPUT_RGB, 0, &image, 1));
        EXPECT_EQ(bytes(host), pixels);
        submit(camera, target);  // unchanged
        submit(sample_camera(kWidth, kHeight, 1 + i), target);
        EXPECT_EQ(pixels, expected(camera)) << "beside a frame";
    }
    submit(sample_camera(kWidth, kHeight, 0.5), target);
    rasterizer_.destroy();
    scene_.destroy();
    device_.destroy();  // while it runs
}

TEST_F(VulkanFrame, ComesFromAnyThread) {
    std::vector<std::thread> threads;
    for (int t = 0; t < 3; ++t)
        threads.emplace_back([&, t] {
            std::byte* host = nullptr;
            VkBuffer buffer = VK_NULL_HANDLE;
            static std::mutex mutex;
            {
                const std::lock_guard lock(mutex);
                buffer = app_.make_buffer(4 * kPixels, &host);
            }
            const auto target = buffer_target(buffer, VK_FORMAT_R8G8B8A8_UNORM, 4 * kPixels);
            const Rasterizer mine =
                make_rasterizer(device_, rasterizer_desc(kCount, kWidth, kHeight));
            const splat_camera camera = sample_camera(kWidth, kHeight, 0.1 * t);
            for (int i = 0; i < 5; ++i) {
                auto frame = sized<splat_vulkan_frame>();
                EXPECT_DONE(splat_rasterizer_submit(mine, nullptr, scene_, &camera, background_,
                                                    &target, &frame));
                app_.wait(frame);
            }
            const std::lock_guard lock(mutex);
            EXPECT_EQ(bytes(host), expected(camera));
        });
    for (std::thread& thread : threads) thread.join();
}

TEST_F(VulkanFrame, RefusesWrongTargets) {
    std::byte* host = nullptr;
    const VkBuffer buffer = app_.make_buffer(4 * kPixels, &host);
    const splat_camera camera = sample_camera(kWidth, kHeight);
    const auto wrong = [&](const char* part, const auto& change) {
        auto target = buffer_target(buffer, VK_FORMAT_R8G8B8A8_UNORM, 4 * kPixels);
        change(target);
        auto frame = sized<splat_vulkan_frame>();
        EXPECT_REFUSED(splat_rasterizer_submit(rasterizer_, nullptr, scene_, &camera, nullptr,
                                               &target, &frame),
                       kArgument, part);
        EXPECT_EQ(frame.value, 0U);
    };
    using Target = splat_vulkan_target;
    wrong("both 0", [](Target& t) { t.buffer = 0; });
    wrong("both given", [](Target& t) { t.image = 1; });
    wrong("format is 44", [](Target& t) { t.format = VK_FORMAT_B8G8R8A8_UNORM; });
    wrong("offset is 2", [](Target& t) { t.offset = 2; });
    wrong("bytes is 7999, but 50 x 40 pixels take 8000", [](Target& t) { t.bytes = 7999; });
    wrong("layout is 1", [](Target& t) { t.layout = 1; });
    wrong("without a wait_semaphore", [](Target& t) { t.wait_value = 1; });
    const auto as_image = [](Target& t) { t.image = std::exchange(t.buffer, 0), t.layout = 1; };
    wrong("bytes is 8000", as_image);
    wrong("offset is 4", [&](Target& t) { as_image(t), t.offset = 4; });
    wrong("layout is 0", [&](Target& t) { as_image(t), t.bytes = 0, t.layout = 0; });
    const Device own = open_device();
    const Rasterizer rasterizer = make_rasterizer(own, rasterizer_desc(kCount, kWidth, kHeight));
    const auto target = buffer_target(buffer, VK_FORMAT_R8G8B8A8_UNORM, 4 * kPixels);
    auto frame = sized<splat_vulkan_frame>();
    EXPECT_REFUSED(
        splat_rasterizer_submit(rasterizer, nullptr, scene_, &camera, nullptr, &target, &frame),
        kState, "is the library's own");
}

}  // namespace
}  // namespace splat::test

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "raster/pixels.h"
#include "raster/raster_scenes.h"
#include "raster/rasterizer_harness.h"
#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/raster_shader.h"
#include "support/require_vulkan.h"
#include "vk/shaders.h"

namespace splat::test {
namespace {

/// Numbers around each limit of rounding to a byte, and what else may come; whole quads.
std::vector<float> numbers_to_round() {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    std::vector<float> values{0, -0.0F, 1, 2, -1, 1e-30F, NAN, kInfinity, -kInfinity};
    for (int k = 0; k < 255; ++k) {
        float value = static_cast<float>((k + 0.5) / 255);
        for (int i = 0; i < 3; ++i) value = std::nextafter(value, 0.0F);
        for (int i = 0; i < 7; ++i, value = std::nextafter(value, 2.0F)) values.push_back(value);
    }
    values.resize((values.size() + 3) / 4 * 4);
    return values;
}

TEST(RasterShaders, PixelsAreRoundedAsTheHostDoes) {
    const std::vector<float> values = numbers_to_round();
    const std::size_t count = values.size() / 4;
    std::vector<std::uint32_t> expected(count);
    for (std::size_t i = 0; i < values.size(); ++i) {
        const double value = 255 * static_cast<double>(values[i]);
        const std::uint32_t byte =
            !(value > 0) ? 0 : static_cast<std::uint32_t>(std::lround(std::min(value, 255.0)));
        expected[i / 4] |= byte << 8 * (i % 4);
    }
    for (const vk::Kernels kernels : kernels_to_test()) {
        const auto context = make_context(context_desc(kernels));
        const vk::Buffer image = upload(*context, values);
        const vk::Buffer bytes = device_buffer(*context, (count + 3) / 4 * 4);
        vk::Recorder recorder(*context);
        ASSERT_OK(raster_pixels(recorder, raster::PixelFormat::kBytes, count, image.range(),
                                bytes.range()));
        vk::CommandList list = std::move(recorder.finish().value());
        ASSERT_OK(context->run(list));
        EXPECT_EQ(download_words(*context, bytes.range(), count), expected);
    }
}

/// Profiles name the shaders that ran. Recording checks each declaration against its shader.
TEST(RasterShaders, EveryModuleIsUsed) {
    std::string used;
    const RasterCase scene = random_scene({20, 33, 20}, 3);
    const RasterCase many = random_scene({20, 16 * 513, 16}, 4);  // too many tiles to be ordered
    ref::RasterLoss<double> loss;
    loss.grad_rgb.assign(3 * scene.pixels(), 1.0);
    for (const vk::Kernels kernels : kernels_to_test()) {
        vk::ContextDesc desc = context_desc(kernels);
        desc.profile = true;
        const auto context = make_context(desc);
        raster::RasterDesc all = raster_desc(scene, kRasterModes[1]);
        all.contributions = true;
        ASSERT_OK(run_raster(*context, scene, all, &loss).status);
        ASSERT_OK(run_raster(*context, many, raster_desc(many, kRasterModes[1])).status);
        const vk::Buffer quad = device_buffer(*context, 4), pixel = device_buffer(*context, 4);
        vk::Recorder recorder(*context);
        ASSERT_OK(raster::raster_pixels(recorder, raster::PixelFormat::kHalves, 1, quad.range(),
                                        pixel.range()));
        vk::CommandList list = std::move(recorder.finish().value());
        ASSERT_OK(context->run(list));
        used += context->profile()->json("");
    }
    if (kernels_to_test().size() < 3)
        SPLAT_SKIP_FOR_DEVICE("this device does not run all sets of kernels");
    for (const vk::ShaderModule& module : vk::shader_modules())
        if (is_raster_shader(module.name)) {
            EXPECT_HAS(used, "\"" + std::string(module.name) + "\"")
                << module.name << " is built in, but nothing uses it";
        }
}

}  // namespace
}  // namespace splat::test

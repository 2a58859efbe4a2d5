#include "raster/pack.h"

#include <gtest/gtest.h>

#include "scene/activate.h"
#include "scene/arrays.h"
#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

constexpr std::size_t kPacked = 70001;  // more than one piece

raster::RasterDesc desc_of(std::size_t count, std::uint32_t degree, bool direct = false) {
    raster::RasterDesc desc;
    desc.gaussians = static_cast<std::uint32_t>(count);
    desc.sh_degree = degree;
    desc.direct_colors = direct;
    return desc;
}

scene::Gaussians random_gaussians(std::size_t count, std::uint32_t degree) {
    scene::Gaussians g = scene::make_gaussians(count, degree);
    std::uint64_t seed = 0;
    for (std::vector<float>* array :
         {&g.means, &g.log_scales, &g.rotations, &g.opacity_logits, &g.sh})
        *array = normal_fill(array->size(), ++seed);
    return g;
}

/// Host and device pack a scene to the same bits.
TEST(Pack, DeviceAndHostAgree) {
    vk::Context* context = shared_context();
    ASSERT_NE(context, nullptr);
    for (const std::uint32_t degree : {0U, 1U, 3U}) {
        const scene::Gaussians host = random_gaussians(kPacked, degree);
        std::vector<float> activated_scales, activated_opacities;
        for (const float value : host.log_scales)
            activated_scales.push_back(static_cast<float>(std::exp(static_cast<double>(value))));
        for (const float value : host.opacity_logits)
            activated_opacities.push_back(
                static_cast<float>(scene::opacity_of(static_cast<double>(value))));
        const raster::RasterDesc desc = desc_of(kPacked, degree);
        auto by_host = raster::allocate_packed(*context, desc);
        auto by_device = raster::allocate_packed(*context, desc);
        ASSERT_OK(by_host.status());
        ASSERT_OK(by_device.status());
        ASSERT_OK(raster::upload_scene(*context, desc, host, by_host.value()));
        const vk::Buffer means = upload(*context, host.means);
        const vk::Buffer scales = upload(*context, activated_scales);
        const vk::Buffer rotations = upload(*context, host.rotations);
        const vk::Buffer opacities = upload(*context, activated_opacities);
        const vk::Buffer sh = upload(*context, host.sh);
        const raster::GaussianAttributes views = {means.range(), scales.range(), rotations.range(),
                                                  opacities.range(), sh.range()};
        vk::Recorder recorder(*context);
        ASSERT_OK(raster::pack_attributes(recorder, desc, views, by_device.value().scene()));
        vk::CommandList list = std::move(recorder.finish().value());
        ASSERT_OK(context->run(list));
        const std::size_t colors = kPacked * desc.color_quads() * 4;
        EXPECT_EQ(download(*context, by_device.value().gaussians.range(), kPacked * 12),
                  download(*context, by_host.value().gaussians.range(), kPacked * 12));
        EXPECT_EQ(download(*context, by_device.value().colors.range(), colors),
                  download(*context, by_host.value().colors.range(), colors));
    }
}

TEST(Pack, UnpackInvertsAndAccumulates) {
    vk::Context* context = shared_context();
    ASSERT_NE(context, nullptr);
    const raster::RasterDesc desc = desc_of(300, 0, true);
    auto packed = raster::allocate_packed(*context, desc);
    ASSERT_OK(packed.status());
    const std::vector<float> means = normal_fill(900, 1);
    const std::vector<float> colors = normal_fill(900, 2);
    const vk::Buffer from_means = upload(*context, means);
    const vk::Buffer from_colors = upload(*context, colors);
    const vk::Buffer to_means = upload(*context, std::vector<float>(900, 1.0F));
    const vk::Buffer to_colors = upload(*context, std::vector<float>(900, 1.0F));
    vk::Recorder recorder(*context);
    raster::GaussianAttributes from;
    from.means = from_means.range();
    from.colors = from_colors.range();
    ASSERT_OK(raster::pack_attributes(recorder, desc, from, packed.value().scene()));
    raster::GaussianAttributes to;
    to.means = to_means.range();
    ASSERT_OK(raster::unpack_gradients(recorder, desc, packed.value().gradients(), to, false));
    raster::GaussianAttributes summed;
    summed.colors = to_colors.range();
    ASSERT_OK(raster::unpack_gradients(recorder, desc, packed.value().gradients(), summed, true));
    vk::CommandList list = std::move(recorder.finish().value());
    ASSERT_OK(context->run(list));
    EXPECT_EQ(download(*context, to_means.range(), 900), means);
    const std::vector<float> sum = download(*context, to_colors.range(), 900);
    for (std::size_t i = 0; i < sum.size(); ++i) EXPECT_EQ(sum[i], 1.0F + colors[i]) << i;
}

TEST(Pack, DegreesAreCutAndPadded) {
    vk::Context* context = shared_context();
    ASSERT_NE(context, nullptr);
    const scene::Gaussians host = random_gaussians(5, 1);
    for (const std::uint32_t degree : {0U, 2U}) {
        const raster::RasterDesc desc = desc_of(5, degree);
        auto packed = raster::allocate_packed(*context, desc);
        ASSERT_OK(packed.status());
        ASSERT_OK(raster::upload_scene(*context, desc, host, packed.value()));
        const std::size_t stride = std::size_t{4} * desc.color_quads();
        const auto colors = download(*context, packed.value().colors.range(), 5 * stride);
        const std::size_t taken = degree == 0 ? 3 : 12;
        for (std::size_t i = 0; i < 5; ++i)
            for (std::size_t k = 0; k < stride; ++k)
                EXPECT_EQ(colors[i * stride + k], k < taken ? host.sh[12 * i + k] : 0.0F);
    }
}

TEST(Pack, ConicsUndoTheFactor) {
    std::vector<float> splats(24);
    splats[4] = 2;
    splats[5] = -1;
    splats[6] = 3;
    const std::vector<float> conics = raster::conics_of(splats, std::vector<float>{4, 4, 0, 0});
    const double unit = 1.3862943611198906;  // 2 ln 2
    EXPECT_FLOAT_EQ(conics[0], static_cast<float>(4 * unit));
    EXPECT_FLOAT_EQ(conics[1], static_cast<float>(-2 * unit));
    EXPECT_FLOAT_EQ(conics[2], static_cast<float>(10 * unit));
    EXPECT_EQ(conics[3], 0.0F) << "culled";
}

}  // namespace
}  // namespace splat::test

#include "gaussians/gaussian_set.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "gaussians/set_statistics.h"
#include "ops/gaussian_rows.h"

#include "scene/activate.h"
#include "scene/arrays.h"
#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

constexpr std::size_t kPacked = 70001;  // more than one piece

gaussians::SetDesc desc_of(std::size_t count, std::uint32_t degree, bool direct = false) {
    return {static_cast<std::uint32_t>(count), degree, direct};
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
TEST(GaussianSet, DeviceAndHostAgree) {
    vk::Context* context = shared_context();
    for (const std::uint32_t degree : {0U, 1U, 3U}) {
        const scene::Gaussians host = random_gaussians(kPacked, degree);
        std::vector<float> activated_scales, activated_opacities;
        for (const float value : host.log_scales)
            activated_scales.push_back(static_cast<float>(std::exp(static_cast<double>(value))));
        for (const float value : host.opacity_logits)
            activated_opacities.push_back(
                static_cast<float>(scene::opacity_of(static_cast<double>(value))));
        const gaussians::SetDesc desc = desc_of(kPacked, degree);
        auto by_host = need(gaussians::allocate_set(*context, desc));
        auto by_device = need(gaussians::allocate_set(*context, desc));
        ASSERT_OK(gaussians::upload(*context, host, by_host));
        const vk::Buffer means = upload(*context, host.means);
        const vk::Buffer scales = upload(*context, activated_scales);
        const vk::Buffer rotations = upload(*context, host.rotations);
        const vk::Buffer opacities = upload(*context, activated_opacities);
        const vk::Buffer sh = upload(*context, host.sh);
        const ops::GaussianRows views = {means.range(), scales.range(), rotations.range(),
                                         opacities.range(), sh.range()};
        vk::Recorder recorder(*context);
        ASSERT_OK(ops::pack_rows(recorder, desc, views, by_device.views()));
        vk::CommandList list = need(recorder.finish());
        ASSERT_OK(context->run(list));
        const std::size_t colors = kPacked * desc.color_quads() * 4;
        EXPECT_EQ(download(*context, by_device.gaussians.range(), kPacked * 12),
                  download(*context, by_host.gaussians.range(), kPacked * 12));
        EXPECT_EQ(download(*context, by_device.colors.range(), colors),
                  download(*context, by_host.colors.range(), colors));
    }
}

TEST(GaussianSet, UnpackInvertsAndAccumulates) {
    vk::Context* context = shared_context();
    const gaussians::SetDesc desc = desc_of(300, 0, true);
    auto packed = need(gaussians::allocate_set(*context, desc));
    const std::vector<float> means = normal_fill(900, 1);
    const std::vector<float> colors = normal_fill(900, 2);
    const vk::Buffer from_means = upload(*context, means);
    const vk::Buffer from_colors = upload(*context, colors);
    const vk::Buffer to_means = upload(*context, std::vector<float>(900, 1.0F));
    const vk::Buffer to_colors = upload(*context, std::vector<float>(900, 1.0F));
    vk::Recorder recorder(*context);
    ops::GaussianRows from;
    from.means = from_means.range();
    from.colors = from_colors.range();
    ASSERT_OK(ops::pack_rows(recorder, desc, from, packed.views()));
    ops::GaussianRows to;
    to.means = to_means.range();
    ASSERT_OK(ops::unpack_rows(recorder, desc, packed.views(), to, false));
    ops::GaussianRows summed;
    summed.colors = to_colors.range();
    ASSERT_OK(ops::unpack_rows(recorder, desc, packed.views(), summed, true));
    vk::CommandList list = need(recorder.finish());
    ASSERT_OK(context->run(list));
    EXPECT_EQ(download(*context, to_means.range(), 900), means);
    const std::vector<float> sum = download(*context, to_colors.range(), 900);
    for (std::size_t i = 0; i < sum.size(); ++i) EXPECT_EQ(sum[i], 1.0F + colors[i]) << i;
}

TEST(GaussianSet, DegreesAreCutAndPadded) {
    vk::Context* context = shared_context();
    const scene::Gaussians host = random_gaussians(5, 1);
    for (const std::uint32_t degree : {0U, 2U}) {
        const gaussians::SetDesc desc = desc_of(5, degree);
        auto packed = need(gaussians::allocate_set(*context, desc));
        ASSERT_OK(gaussians::upload(*context, host, packed));
        const std::size_t stride = std::size_t{4} * desc.color_quads();
        const auto colors = download(*context, packed.colors.range(), 5 * stride);
        const std::size_t taken = degree == 0 ? 3 : 12;
        for (std::size_t i = 0; i < 5; ++i)
            for (std::size_t k = 0; k < stride; ++k)
                EXPECT_EQ(colors[i * stride + k], k < taken ? host.sh[12 * i + k] : 0.0F);
    }
}

/// Nine Gaussians of which an image can show the first, the fifth, and the last two until their opacities change.
scene::Gaussians doubtful_gaussians() {
    scene::Gaussians g = scene::make_gaussians(9, 0);
    const double opacities[] = {0.5, 1.0 / 300, 0.9, 0.9, 1.0 / 200, 0.9, 0.9, 0.9, 0.9};
    for (std::size_t i = 0; i < 9; ++i) {
        g.means[3 * i] = static_cast<float>(i);
        g.rotations[4 * i] = 1;
        g.opacity_logits[i] = static_cast<float>(scene::logit_of(opacities[i]));
    }
    g.means[3 * 2] = std::numeric_limits<float>::quiet_NaN();
    g.log_scales[3 * 3] = std::numeric_limits<float>::infinity();
    g.rotations[4 * 5] = 0;
    g.sh[3 * 6 + 2] = std::numeric_limits<float>::quiet_NaN();
    return g;
}

TEST(GaussianSet, DownloadsWhatAnImageCanShow) {
    vk::Context* context = shared_context();
    auto set = need(gaussians::allocate_set(*context, desc_of(9, 0)));
    ASSERT_OK(gaussians::upload(*context, doubtful_gaussians(), set));
    std::vector<float> packed = download(*context, set.gaussians.range(), 9 * 12);
    packed[12 * 7 + 3] = 1.5F;  // no logit gives these
    packed[12 * 8 + 3] = -0.5F;
    ASSERT_OK(context->write(set.gaussians.range(), packed.data(), packed.size() * 4));
    const auto shown = need(gaussians::download(*context, set.desc, set.views(), false));
    EXPECT_EQ(shown.not_finite, 6U);
    EXPECT_EQ(shown.faint, 1U);
    ASSERT_EQ(shown.gaussians.count(), 2U);
    EXPECT_EQ(shown.gaussians.means[0], 0.0F);
    EXPECT_EQ(shown.gaussians.means[3], 4.0F);
    EXPECT_OK(scene::check_arrays(shown.gaussians));
}

TEST(GaussianSet, DownloadsAllThatWasUploaded) {
    vk::Context* context = shared_context();
    const scene::Gaussians host = random_gaussians(300, 1);
    auto set = need(gaussians::allocate_set(*context, desc_of(400, 1)));
    ASSERT_OK(gaussians::upload(*context, host, set));
    const std::uint64_t version = set.version;
    ASSERT_OK(gaussians::upload(*context, host, set));
    EXPECT_NE(set.version, version);
    const scene::Gaussians got =
        need(gaussians::download(*context, set.desc, set.views(), true)).gaussians;
    EXPECT_EQ(got.means, host.means);
    EXPECT_EQ(got.rotations, host.rotations);
    EXPECT_EQ(got.sh, host.sh);
    ASSERT_EQ(got.count(), 300U);
    for (std::size_t i = 0; i < 300; ++i) {
        EXPECT_NEAR(got.opacity_logits[i], host.opacity_logits[i], 1e-5) << i;
        EXPECT_NEAR(got.log_scales[3 * i], host.log_scales[3 * i], 1e-6) << i;
    }
}

TEST(GaussianSet, AFlatGaussianGetsTheLeastScale) {
    vk::Context* context = shared_context();
    scene::Gaussians host = random_gaussians(1, 0);
    host.log_scales[1] = -500;
    auto set = need(gaussians::allocate_set(*context, desc_of(1, 0)));
    ASSERT_OK(gaussians::upload(*context, host, set));
    const auto all = need(gaussians::download(*context, set.desc, set.views(), true));
    EXPECT_EQ(all.gaussians.log_scales[1], std::log(std::numeric_limits<float>::min()));
}

gaussians::SetStatistics statistics_of(vk::Context& context, const gaussians::GaussianSet& set) {
    const vk::Buffer partial = device_buffer(context, gaussians::set_statistics_bytes(set.count));
    vk::Recorder recorder(context);
    EXPECT_OK(gaussians::set_statistics(recorder, set.desc, set.views(), partial.range()));
    vk::CommandList list = need(recorder.finish());
    EXPECT_OK(context.run(list));
    std::vector<std::uint32_t> words(gaussians::set_statistics_bytes(set.count) / 4);
    EXPECT_OK(context.read(partial.range(), words.data(), words.size() * 4));
    return gaussians::set_statistics_sum(words);
}

TEST(SetStatistics, CountEachGaussianOnce) {
    vk::Context* context = shared_context();
    constexpr std::size_t kCount = 2500;  // more than two chunks
    scene::Gaussians host = scene::make_gaussians(kCount, 1);
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
    host.means[0] = kNaN;
    host.log_scales[1] = kInfinity;  // the same Gaussian
    host.opacity_logits[0] = -7;     // the same Gaussian is faint, too
    host.sh[12 * 1030 + 11] = -kInfinity;
    host.opacity_logits[3] = -6;  // opacity 0.0025
    host.opacity_logits[2499] = -6;
    host.opacity_logits[4] = kNaN;
    auto set = need(gaussians::allocate_set(*context, desc_of(kCount, 1)));
    ASSERT_OK(gaussians::upload(*context, host, set));
    const gaussians::SetStatistics found = statistics_of(*context, set);
    EXPECT_EQ(found.numbers_not_finite, 4U);
    EXPECT_EQ(found.not_finite, 3U);
    EXPECT_EQ(found.faint, 3U);
    EXPECT_EQ(found.invisible, 2U);
}

TEST(SetStatistics, LeastVisibleOpacity) {
    vk::Context* context = shared_context();
    const float least = 1.0F / 255;
    auto set = need(gaussians::allocate_set(*context, desc_of(2, 0)));
    std::vector<float> quads(24);
    quads[3] = least;
    quads[15] = std::nextafter(least, 0.0F);
    ASSERT_OK(context->write(set.gaussians.range(), quads.data(), quads.size() * 4));
    EXPECT_EQ(statistics_of(*context, set).faint, 1U);
}

}  // namespace
}  // namespace splat::test

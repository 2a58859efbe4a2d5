// What a Gaussian adds to images: weights, pixels, and the pixels where its weight is the largest.
#include <gtest/gtest.h>

#include <algorithm>

#include "ops/op_harness.h"
#include "raster/fragile.h"
#include "raster/raster_scenes.h"
#include "raster/raster_session.h"
#include "support/gpu_buffers.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

class RasterizerContributions : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(RasterizerContributions);

/// Weight that rounding moves on a fragile pixel: alpha at 1/255, or T where a pixel stops.
constexpr double kFlip = 0.0101;

std::vector<RasterCase> two_views(const RasterCase& scene) {
    std::vector<RasterCase> views(2, scene);
    views[1].camera.world_to_camera[3] += 0.3F;
    return views;
}

/// Image, contributions, gradients of one call with both views.
struct Drawing {
    std::vector<float> image, extra, contributions, gradients;
    std::uint32_t passes = 0;
};

Drawing drawing_of(vk::Context& context, const std::vector<RasterCase>& views,
                   const raster::RasterDesc& desc) {
    RasterSession session(context, views[0], desc);
    EXPECT_OK(session);
    std::vector<scene::Camera> cameras;
    for (const RasterCase& view : views) cameras.push_back(camera_of(view));
    EXPECT_OK(session.forward(cameras));
    EXPECT_OK(session.backward(normal_fill(4 * desc.pixels(), 1)));
    const raster::Workspace& space = session.rasterizer().workspace();
    const std::uint64_t numbers = desc.contributions ? 2 * desc.gaussians : 0;
    return {session.image(),
            desc.extra ? download(context, space.extra.range(), 4 * desc.pixels())
                       : std::vector<float>(),
            download(context, space.contributions.range(), numbers), session.gradients(),
            session.rasterizer().stats().passes};
}

raster::RasterDesc contribution_desc(const RasterCase& scene, const RasterMode& mode) {
    raster::RasterDesc desc = with_gradients(raster_desc(scene, mode));
    desc.normals = false;
    desc.ids = true;
    desc.views = 2;
    return desc;
}

void expect_contributions(vk::Context& context, const RasterCase& scene, const RasterMode& mode) {
    SCOPED_TRACE(scene.name + " " + mode.name);
    const std::vector<RasterCase> views = two_views(scene);
    const Drawing got = drawing_of(context, views, contribution_desc(scene, mode));
    std::vector<double> weights(scene.count());
    std::vector<std::int64_t> pixels(scene.count());
    std::int64_t fragile = 0, drawn = 0, skipped = 0;
    for (std::size_t v = 0; v < 2; ++v) {
        const auto from = reference_scene<double>(views[v], mode);
        const auto expected = ref::blend_contributions(from, ref::project_forward(from));
        const std::vector<bool> spoiled = fragile_pixels(from);
        for (std::size_t i = 0; i < scene.count(); ++i) {
            weights[i] += expected.weights[i];
            pixels[i] += expected.pixels[i];
        }
        for (std::size_t p = 0; p < scene.pixels(); ++p) {
            fragile += spoiled[p] ? 1 : 0;
            const bool decided = expected.largest[p] > 1.0001 * expected.second[p];
            if (spoiled[p] || (expected.ids[p] >= 0 && !decided)) {
                ++skipped;
                continue;
            }
            ASSERT_EQ(got.extra[4 * (v * scene.pixels() + p) + 3],
                      static_cast<float>(expected.ids[p]))
                << "view " << v << ", pixel " << p;
            drawn += expected.ids[p] >= 0 ? 1 : 0;
        }
    }
    EXPECT_GT(drawn, static_cast<std::int64_t>(scene.pixels() / 4));
    EXPECT_LT(10 * skipped, static_cast<std::int64_t>(2 * scene.pixels()));
    const double most = *std::max_element(weights.begin(), weights.end());
    EXPECT_GT(most, 1);
    for (std::size_t i = 0; i < scene.count(); ++i) {
        EXPECT_NEAR(static_cast<double>(got.contributions[2 * i]), weights[i],
                    1e-5 * most + kFlip * static_cast<double>(fragile))
            << i;
        EXPECT_NEAR(static_cast<double>(got.contributions[2 * i + 1]),
                    static_cast<double>(pixels[i]), static_cast<double>(fragile))
            << i;
    }
}

TEST_P(RasterizerContributions, AreThoseOfTheReference) {
    expect_contributions(context(), random_scene({8, 37, 29}, 120, 1), kRasterModes[0]);
    expect_contributions(context(), random_scene({8, 37, 29}, 121, 1), kRasterModes[1]);
    expect_contributions(context(), opaque_scene({30, 37, 29}, 122), kRasterModes[2]);
}

TEST_P(RasterizerContributions, ChangeNothingElse) {
    const std::vector<RasterCase> views = two_views(random_scene({60, 37, 29}, 123, 1));
    raster::RasterDesc desc = contribution_desc(views[0], kRasterModes[1]);
    const Drawing with = drawing_of(context(), views, desc);
    desc.ids = desc.contributions = desc.grad_intrinsics = false;
    Drawing without = drawing_of(context(), views, desc);
    EXPECT_EQ(with.image, without.image);
    EXPECT_EQ(with.gradients, without.gradients);
    for (std::size_t p = 3; p < without.extra.size(); p += 4) {
        EXPECT_EQ(without.extra[p], 0);
        without.extra[p] = with.extra[p];
    }
    EXPECT_EQ(with.extra, without.extra);
}

/// Groups of tile rows are drawn one by one.
TEST_P(RasterizerContributions, PassesAreAdded) {
    RasterCase scene = random_scene({300, 32, 64}, 124, 0);
    for (float& scale : scene.scales) scale *= 30;
    for (float& opacity : scene.opacities) opacity *= 0.05F;
    const std::vector<RasterCase> views = two_views(scene);
    const raster::RasterDesc desc = contribution_desc(views[0], kRasterModes[1]);
    vk::ContextDesc lowered = context_desc(GetParam());
    const std::uint64_t record_bytes = GetParam() == vk::Kernels::kCpu ? 16 : 64;  // in one binding
    lowered.device.fake = [record_bytes](vk::DeviceInfo& info) {
        info.limits.max_storage_buffer_bytes = 32 * 64 * 2 * record_bytes;
    };
    const auto narrow = make_context(lowered);
    const Drawing whole = drawing_of(context(), views, desc);
    const Drawing groups = drawing_of(*narrow, views, desc);
    EXPECT_EQ(whole.passes, 1U);
    EXPECT_GE(groups.passes, 2U);
    EXPECT_EQ(groups.image, whole.image);
    EXPECT_LE(relative_difference(groups.contributions, whole.contributions), 1e-6);
}

}  // namespace
}  // namespace splat::test

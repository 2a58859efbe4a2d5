// Gaussians that take several dispatches: the same bits.
#include <gtest/gtest.h>

#include "ops/op_harness.h"
#include "raster/raster_scenes.h"
#include "raster/raster_session.h"
#include "support/gpu_buffers.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

class RasterizerSlices : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(RasterizerSlices);

/// All that one call of each kind leaves.
struct Results {
    std::vector<float> image, normals, gradients, exported, pose;
    raster::RasterStats stats;
};

Results results_of(vk::Context& context, const RasterCase& scene, const raster::RasterDesc& desc) {
    RasterSession session(context, scene, desc);
    EXPECT_OK(session.status());
    if (!session.status().ok()) return {};
    const std::size_t pixels = scene.pixels();
    Results results;
    EXPECT_OK(session.forward());
    EXPECT_OK(session.backward(normal_fill(4 * pixels, 1), normal_fill(pixels, 2)));
    const raster::Workspace& space = session.rasterizer().workspace();
    results.image = session.image();
    results.normals = download(context, space.normal_image.range(), 4 * pixels);
    results.gradients = session.gradients();
    results.exported = session.exported();
    results.pose = download(context, space.pose.range(), 12);
    results.stats = session.rasterizer().stats();
    return results;
}

/// 1000 Gaussians of 12 quads of colours in slices of 256, the last one shorter.
TEST_P(RasterizerSlices, SlicesOfGaussiansGiveTheSameBits) {
    const RasterCase scene = random_scene({1000, 40, 33}, 95, 3);
    const raster::RasterDesc desc = with_gradients(raster_desc(scene, kRasterModes[1]));
    vk::ContextDesc lowered = context_desc(GetParam());
    lowered.device.fake = [](vk::DeviceInfo& info) {
        info.limits.max_storage_buffer_bytes = 256 * 12 * 16;
    };
    const auto narrow = make_context(lowered);
    ASSERT_NE(narrow, nullptr);
    ASSERT_EQ(raster::slice_size(narrow->device().info(), desc), 256U);
    ASSERT_GT(raster::slice_size(context().device().info(), desc), 1000U);
    const Results whole = results_of(context(), scene, desc);
    const Results slices = results_of(*narrow, scene, desc);
    ASSERT_EQ(slices.stats.passes, 1U) << "gradients are added in another order";
    EXPECT_EQ(slices.stats.visible, whole.stats.visible);
    EXPECT_GT(whole.stats.visible, 800U);
    EXPECT_EQ(slices.image, whole.image);
    EXPECT_EQ(slices.normals, whole.normals);
    EXPECT_EQ(slices.gradients, whole.gradients);
    EXPECT_EQ(slices.exported, whole.exported);
    EXPECT_EQ(slices.pose, whole.pose);
}

}  // namespace
}  // namespace splat::test

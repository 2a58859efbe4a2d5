// Forward blending by the kernel for GPUs gives the bits of the plain one, in every output.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "ops/op_harness.h"
#include "raster/raster_scenes.h"
#include "raster/raster_session.h"
#include "support/gpu_buffers.h"

namespace splat::test {
namespace twins {

constexpr std::uint32_t kViews = 3;

class BlendTwins : public KernelsTest {
  protected:
    /// Other devices may fuse multiply-adds, otherwise in each kernel.
    void SetUp() override {
        KernelsTest::SetUp();
        if (IsSkipped() || HasFatalFailure()) return;
        if (context().device().info().kind != vk::DeviceKind::kCpu) GTEST_SKIP() << "CPU devices";
        plain_ = shared_context(vk::Kernels::kPlain);
        ASSERT_NE(plain_, nullptr);
    }
    [[nodiscard]] vk::Context& plain() const { return *plain_; }

  private:
    vk::Context* plain_ = nullptr;
};
INSTANTIATE_TEST_SUITE_P(Kernels, BlendTwins, testing::Values(vk::Kernels::kGpu),
                         kernels_test_name);

/// What the cameras of a call see, besides the scene.
struct Call {
    std::vector<scene::Camera> cameras;
    std::vector<raster::Range> ranges;
    std::vector<std::uint8_t> mask;
};

/// A whole view, and two smaller ones from other sides. The second looks from within the scene.
Call call_of(const RasterCase& scene, const raster::RasterDesc& desc) {
    Call call;
    call.cameras.assign(desc.views, camera_of(scene));
    for (std::uint32_t v = 1; v < desc.views; ++v) {
        scene::Camera& camera = call.cameras[v];
        camera.width -= 9 * v;
        camera.height -= 4 * v;
        camera.world_to_camera[3] += 0.3 * v;
        if (v == 1) camera.world_to_camera[11] -= 3.5;
    }
    return call;
}

using Outputs = std::vector<std::vector<float>>;

/// Image, transmittance with the entry of the stop, depth with ids, and normals.
Outputs draw(vk::Context& context, const RasterCase& scene, const raster::RasterDesc& desc,
             const Call& call) {
    RasterSession session(context, scene, desc);
    EXPECT_OK(session);
    if (!session.status().ok()) return {};
    raster::Rasterizer& rasterizer = session.rasterizer();
    auto views = need(raster::pack_views(rasterizer.desc(), call.cameras, scene.background));
    if (!call.mask.empty()) {
        EXPECT_OK(raster::mask_tiles(rasterizer.desc(), call.mask, views));
    }
    if (!call.ranges.empty()) {
        EXPECT_OK(raster::see_ranges(context.device().info(), rasterizer.desc(), desc.gaussians,
                                     call.ranges, views));
    }
    EXPECT_OK(rasterizer.forward(session.scene().views(), views));
    EXPECT_GT(rasterizer.stats().pairs, 0U);
    const raster::Workspace& space = rasterizer.workspace();
    Outputs all = {download(context, space.image.range(), 4 * desc.pixels()),
                   download(context, space.state.range(), 2 * desc.pixels())};
    if (desc.extra) all.push_back(download(context, space.extra.range(), 4 * desc.pixels()));
    if (desc.median) all.push_back(download(context, space.median.range(), desc.pixels()));
    if (desc.normals)
        all.push_back(download(context, space.normal_image.range(), 4 * desc.pixels()));
    return all;
}

bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

void expect_same(const Outputs& got, const Outputs& expected, const std::string& what) {
    ASSERT_EQ(got.size(), expected.size()) << what;
    for (std::size_t i = 0; i < got.size(); ++i)
        EXPECT_TRUE(same_bits(got[i], expected[i])) << what << ", output " << i;
}

raster::RasterDesc desc_of(const RasterCase& scene, const RasterMode& mode) {
    raster::RasterDesc desc = raster_desc(scene, mode);
    desc.extra = desc.normals = desc.ids = true;
    desc.backward = !mode.is_ray();
    desc.views = kViews;
    return desc;
}

void expect_twins(vk::Context& context, vk::Context& plain, const RasterCase& scene,
                  const raster::RasterDesc& desc, const Call& call) {
    SCOPED_TRACE(scene.name);
    const Outputs expected = draw(plain, scene, desc, call);
    for (const bool blocks : {true, false}) {
        for (const bool early_out : {true, false}) {
            raster::RasterDesc skips = desc;
            skips.skips.blocks = blocks;
            skips.skips.early_out = early_out;
            expect_same(draw(context, scene, skips, call), expected,
                        format("blocks %d, early_out %d", blocks, early_out));
        }
    }
}

RasterCase scaled(RasterCase scene, float by, const char* name) {
    for (float& scale : scene.scales) scale *= by;
    scene.name = name;
    return scene;
}

/// Large, tiny, long and thin ones, ones far outside the image, and ones that saturate; no size is a multiple of 16.
TEST_P(BlendTwins, ScenesOfAllKinds) {
    const RasterCase scenes[] = {random_scene({300, 75, 41}, 201),
                                 scaled(random_scene({200, 53, 35}, 202), 20, "large"),
                                 scaled(random_scene({800, 75, 41}, 203), 0.02F, "tiny"),
                                 needle_scene({120, 75, 41}, 204, 3),
                                 wide_scene({60, 47, 39}, 205),
                                 opaque_scene({300, 61, 50}, 206)};
    std::size_t i = 0;
    for (const RasterCase& scene : scenes) {
        const raster::RasterDesc desc = desc_of(scene, kRasterModes[i++ % 3]);
        expect_twins(context(), plain(), scene, desc, call_of(scene, desc));
    }
}

TEST_P(BlendTwins, CutAndByDistance) {
    const RasterCase scene = opaque_scene({300, 61, 50}, 210);
    for (const RasterMode& mode : std::span(kDrawnModes).last(2)) {
        const raster::RasterDesc desc = desc_of(scene, mode);
        expect_twins(context(), plain(), scene, desc, call_of(scene, desc));
    }
}

TEST_P(BlendTwins, RayMaximum) {
    const RasterCase scenes[] = {random_scene({300, 75, 41}, 211),
                                 needle_scene({120, 75, 41}, 212, 3),
                                 opaque_scene({300, 61, 50}, 213)};
    for (const RasterCase& scene : scenes) {
        const raster::RasterDesc desc = desc_of(scene, kRayModes[0]);
        Call call = call_of(scene, desc);
        expect_twins(context(), plain(), scene, desc, call);
        call.ranges = {{20, 100}, {0, 120}, {100, 10}};
        expect_twins(context(), plain(), scene, desc, call);
    }
}

/// Without the outputs that may be left out, in one view.
TEST_P(BlendTwins, ImagesAlone) {
    const RasterCase scene = opaque_scene({300, 61, 50}, 207);
    raster::RasterDesc desc = desc_of(scene, kRasterModes[1]);
    desc.extra = desc.normals = desc.ids = false;
    desc.views = 1;
    expect_twins(context(), plain(), scene, desc, call_of(scene, desc));
}

TEST_P(BlendTwins, MasksAndRanges) {
    const RasterCase scene = random_scene({300, 75, 41}, 208);
    const raster::RasterDesc desc = desc_of(scene, kRasterModes[0]);
    Call call = call_of(scene, desc);
    call.ranges = {{20, 150}, {0, 300}, {100, 90}};
    expect_twins(context(), plain(), scene, desc, call);
    call.mask.resize(std::size_t{desc.tiles_x()} * desc.tiles_y() * kViews);
    for (std::size_t t = 0; t < call.mask.size(); ++t) call.mask[t] = t % 3 == 1 ? 0 : 1;
    expect_twins(context(), plain(), scene, desc, call);
    call.ranges.clear();
    expect_twins(context(), plain(), scene, desc, call);
}

/// Lists of several batches, at once and in parts as short as they may be. Pixels stop in the first, in the last, and
/// not at all, some of them sooner than others of their tile.
TEST_P(BlendTwins, LongListsWholeAndInParts) {
    double& factor = raster::blend_pace(context(), false).factor;
    const double before = factor;
    for (const float opacity : {0.05F, 0.014F, 0.005F}) {
        RasterCase scene = scaled(random_scene({700, 37, 23}, 209), 30, "long lists");
        for (std::size_t i = 0; i < scene.count(); ++i) {
            const bool dense = i % 16 == 0;
            scene.opacities[i] = dense ? 0.9F : opacity * (1 + 0.5F * static_cast<float>(i % 7));
            for (std::size_t k = 0; k < 3 && dense; ++k) scene.scales[3 * i + k] *= 0.1F;
        }
        const raster::RasterDesc desc = desc_of(scene, kRasterModes[1]);
        const Call call = call_of(scene, desc);
        expect_twins(context(), plain(), scene, desc, call);
        factor = 1e9;
        EXPECT_EQ(raster::part_entries(context(), false), 256U);
        scene.name = "parts";
        expect_twins(context(), plain(), scene, desc, call);
        factor = before;
    }
}

}  // namespace twins
}  // namespace splat::test

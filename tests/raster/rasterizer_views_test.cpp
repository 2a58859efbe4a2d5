// One call with several cameras equals one call per camera.
#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "ops/op_harness.h"
#include "raster/raster_scenes.h"
#include "raster/raster_session.h"
#include "support/gpu_buffers.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

class RasterizerViews : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(RasterizerViews);

constexpr std::uint32_t kViews = 3;

/// Cameras around the scene. The second is far away, the third is turned away and sees nothing.
std::vector<scene::Camera> cameras_of(const RasterCase& scene) {
    std::vector<scene::Camera> cameras(kViews, camera_of(scene));
    cameras[1].world_to_camera[11] += 2.5;
    cameras[1].world_to_camera[3] += 0.3;
    cameras[1].fx *= 1.4;
    cameras[1].cx -= 3;
    cameras[2].world_to_camera[11] = -50;
    return cameras;
}

std::vector<float> pose_of(vk::Context& context, RasterSession& session) {
    return download(context, session.rasterizer().workspace().pose.range(),
                    std::size_t{12} * session.rasterizer().desc().views);
}

template <class T>
std::vector<T> part(const std::vector<T>& all, std::size_t index, std::size_t parts) {
    const auto size = static_cast<std::ptrdiff_t>(all.size() / parts);
    const auto first = all.begin() + static_cast<std::ptrdiff_t>(index) * size;
    return {first, first + size};
}

void expect_views(vk::Context& context, const RasterCase& scene, const RasterMode& mode) {
    const std::vector<scene::Camera> cameras = cameras_of(scene);
    raster::RasterDesc desc = with_gradients(raster_desc(scene, mode));
    RasterSession single(context, scene, desc);
    desc.views = kViews;
    RasterSession together(context, scene, desc);
    ASSERT_OK(together);
    ASSERT_OK(together.forward(cameras));
    const std::vector<float> grad_image = normal_fill(4 * kViews * scene.pixels(), 1);
    const std::vector<float> grad_depth = normal_fill(kViews * scene.pixels(), 2);
    ASSERT_OK(together.backward(grad_image, grad_depth));
    std::vector<float> sum;
    std::uint64_t pairs = 0;
    for (std::size_t v = 0; v < kViews; ++v) {
        SCOPED_TRACE(v);
        ASSERT_OK(single.forward({&cameras[v], 1}));
        pairs += single.rasterizer().stats().pairs;
        EXPECT_EQ(part(together.image(), v, kViews), single.image());
        ASSERT_OK(single.backward(part(grad_image, v, kViews), part(grad_depth, v, kViews)));
        EXPECT_EQ(part(together.exported(), v, kViews), single.exported());
        EXPECT_EQ(part(pose_of(context, together), v, kViews), pose_of(context, single));
        const std::vector<float> gradients = single.gradients();
        sum.resize(gradients.size());
        for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += gradients[i];
    }
    EXPECT_EQ(together.rasterizer().stats().pairs, pairs);
    // The sum of three roundings, once before and once after the unit quaternion's projection.
    EXPECT_LE(relative_difference(together.gradients(), sum), 1e-6);
}

TEST_P(RasterizerViews, EqualSingleCalls) {
    expect_views(context(), random_scene({100, 37, 29}, 90, 2), kRasterModes[0]);
    expect_views(context(), tie_scene({60, 40, 33}, 91), kRasterModes[2]);
}

/// x / z and y / z of R m + t do not change with a common factor of R and t, so gradients of these are divided by it.
TEST_P(RasterizerViews, PoseGradientsHoldForScaledCameras) {
    const RasterCase scene = random_scene({100, 37, 29}, 93, 2);
    const std::vector<float> weights = normal_fill(4 * scene.pixels(), 4);
    RasterSession session(context(), scene, with_gradients(raster_desc(scene, kRasterModes[1])));
    ASSERT_OK(session);
    std::vector<float> poses[2];
    for (const double factor : {1.0, 2.0}) {
        scene::Camera camera = camera_of(scene);
        for (std::size_t i = 0; i < 12; ++i) camera.world_to_camera[i] *= factor;
        ASSERT_OK(session.forward({&camera, 1}));
        ASSERT_OK(session.backward(weights));
        std::vector<float>& pose = poses[factor > 1 ? 1 : 0];
        pose = pose_of(context(), session);
        for (float& g : pose) g *= static_cast<float>(factor);
    }
    EXPECT_LE(relative_difference(poses[1], poses[0]), 1e-5);
}

/// gsplat's convention normalises rotations, of any length.
TEST_P(RasterizerViews, LongRotationsAreTheirUnitOnes) {
    const RasterCase unit = random_scene({100, 37, 29}, 94, 1);
    RasterCase scaled = unit;
    for (float& q : scaled.rotations) q *= 0x1p80F;
    std::vector<float> images[2], normals[2];
    for (const RasterCase* scene : {&unit, &std::as_const(scaled)}) {
        raster::RasterDesc desc = with_gradients(raster_desc(*scene, kRasterModes[1]));
        desc.normals = true;
        RasterSession session(context(), *scene, desc);
        ASSERT_OK(session.forward());
        ASSERT_OK(session.backward(normal_fill(4 * scene->pixels(), 5)));
        EXPECT_EQ(session.rasterizer().stats().non_finite, 0U);
        const std::size_t i = scene == &unit ? 0 : 1;
        images[i] = session.image();
        normals[i] = download(context(), session.rasterizer().workspace().normal_image.range(),
                              4 * scene->pixels());
        for (const float g : session.gradients()) ASSERT_TRUE(std::isfinite(g));
    }
    EXPECT_LE(relative_difference(images[1], images[0]), 1e-5);
    EXPECT_LE(relative_difference(normals[1], normals[0]), 1e-5);
}

class RasterizerViewsFull : public RasterizerViews {};
SPLAT_INSTANTIATE_KERNELS(RasterizerViewsFull);

TEST_P(RasterizerViewsFull, EqualSingleCalls) {
    for (const RasterMode& mode : kRasterModes) {
        SCOPED_TRACE(mode.name);
        expect_views(context(), random_scene({150, 37, 29}, 90, 2), mode);
        expect_views(context(), tie_scene({80, 50, 33}, 91), mode);
    }
}

/// Draws the most views that kMaxWindowTiles allows: the gradient's loops take turns for each view, and
/// lavapipe ends loops after 65535 turns.
TEST_P(RasterizerViewsFull, ManyViewsAreRightToTheLast) {
    const RasterCase scene = random_scene({3, 8, 8}, 92, 0);
    raster::RasterDesc desc = with_gradients(raster_desc(scene, kRasterModes[1]));
    RasterSession single(context(), scene, desc);
    ASSERT_OK(single.forward());
    const std::vector<float> weights = normal_fill(4 * scene.pixels(), 3);
    ASSERT_OK(single.backward(weights));
    const std::vector<float> expected = pose_of(context(), single);
    for (const std::uint32_t views : {1000U, 20000U}) {
        desc.views = views;
        RasterSession many(context(), scene, desc);
        ASSERT_OK(many);
        ASSERT_OK(many.forward());
        std::vector<float> all;
        for (std::uint32_t v = 0; v < views; ++v)
            all.insert(all.end(), weights.begin(), weights.end());
        ASSERT_OK(many.backward(all));
        EXPECT_EQ(part(pose_of(context(), many), views - 1, views), expected) << views;
        EXPECT_EQ(part(many.exported(), views - 1, views), single.exported()) << views;
    }
}

}  // namespace
}  // namespace splat::test

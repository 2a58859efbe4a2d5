// What a Rasterizer accepts and refuses, images of odd sizes, scenes without Gaussians, and calls
// that are skipped because nothing changed.
#include "raster/rasterizer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <limits>

#include "ops/op_harness.h"
#include "raster/raster_scenes.h"
#include "raster/raster_session.h"

namespace splat::test {
namespace {

class Rasterizer : public KernelsTest {
  protected:
    [[nodiscard]] Status create_status(const raster::RasterDesc& desc) const {
        return raster::Rasterizer::create(context(), desc).status();
    }
};
SPLAT_INSTANTIATE_KERNELS(Rasterizer);

const SceneSize kSmall = {40, 37, 21};

raster::RasterDesc small_desc() {
    return raster_desc(random_scene(kSmall, 3), kRasterModes[0]);
}

TEST_P(Rasterizer, RefusesDescriptionsThatMakeNoSense) {
    const auto refuses = [&](auto change, Code code, const char* part) {
        raster::RasterDesc desc = small_desc();
        change(desc);
        EXPECT_ERROR(create_status(desc), code, part);
    };
    using Desc = raster::RasterDesc;
    const float nan = std::numeric_limits<float>::quiet_NaN();
    refuses([](Desc& d) { d.width = 0; }, Code::kInvalidArgument, "1 views of 0 x 21 pixels");
    refuses([](Desc& d) { d.height = 0; }, Code::kInvalidArgument, "1 views of 37 x 0 pixels");
    refuses([](Desc& d) { d.views = 0; }, Code::kInvalidArgument, "0 views");
    refuses([](Desc& d) { d.sh_degree = 4; }, Code::kInvalidArgument, "degree 4, expected 0 to 3");
    refuses([](Desc& d) { d.near_plane = 0; }, Code::kInvalidArgument, "near plane 0");
    refuses([=](Desc& d) { d.near_plane = nan; }, Code::kInvalidArgument, "near plane nan");
    refuses([](Desc& d) { d.far_plane = d.near_plane; }, Code::kInvalidArgument, "near < far");
    refuses([=](Desc& d) { d.far_plane = nan; }, Code::kInvalidArgument, "far plane nan");
    refuses([](Desc& d) { d.gaussians = ~0U; }, Code::kUnsupported, "render fewer views per call");
    refuses([](Desc& d) { d.views = 1U << 31; }, Code::kUnsupported, "render fewer views per call");
    refuses([](Desc& d) { d.width = d.height = ~0U; }, Code::kUnsupported, "or smaller ones");
    refuses([](Desc& d) { d.gaussians = 1, d.width = 1U << 20, d.height = 1; }, Code::kUnsupported,
            "a row of 65536 tiles");
    refuses([](Desc& d) { d.gaussians = 1, d.width = 1U << 20, d.height = 1; }, Code::kUnsupported,
            "render fewer views per call, or narrower images");
}

TEST_P(Rasterizer, RefusesCamerasAndLeavesTheImage) {
    const RasterCase scene = random_scene(kSmall, 3);
    RasterSession session(context(), scene, with_gradients(small_desc()));
    ASSERT_OK(session);
    ASSERT_OK(session.forward());
    const std::vector<float> image = session.image();
    const auto refuses = [&](auto change, const char* part) {
        scene::Camera camera = camera_of(scene);
        camera.name = "left";
        change(camera);
        EXPECT_ERROR(session.forward({&camera, 1}), Code::kInvalidArgument, part);
        EXPECT_EQ(session.image(), image) << part;
    };
    using Camera = scene::Camera;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double infinity = std::numeric_limits<double>::infinity();
    refuses([](Camera& c) { c.width = 38; }, "camera left: 38 x 21 pixels, but the rasterizer was");
    refuses([](Camera& c) { c.height = 22; }, "37 x 22 pixels");
    refuses([=](Camera& c) { c.world_to_camera[5] = nan; }, "camera left: a pose or intrinsic");
    refuses([=](Camera& c) { c.world_to_camera[3] = infinity; }, "is not finite");
    refuses([=](Camera& c) { c.world_to_camera[3] = 1e39; }, "camera left: its pose, its position");
    refuses([=](Camera& c) { c.cx = nan; }, "is not finite");
    refuses([](Camera& c) { c.fx = 0; }, "camera left: focal lengths are 0 and");
    refuses([](Camera& c) { c.fy = -3; }, "expected > 0");
    refuses([](Camera& c) { c.fx = 5e-312; }, "expected 1e-06 to 1e+09");
    refuses([](Camera& c) { c.cx = 1e308; }, "camera left: the principal point is 1e+308");
    refuses([](Camera& c) { c.world_to_camera[15] = 2; }, "is 0 0 0 2, expected 0 0 0 1");
    refuses([](Camera& c) { c.world_to_camera[12] = 1; }, "is 1 0 0 1, expected 0 0 0 1");
    refuses(
        [](Camera& c) {
            for (std::size_t i = 0; i < 3; ++i) c.world_to_camera[i] *= -1;
        },
        "its rotation mirrors (determinant -1)");
    refuses([](Camera& c) { std::fill_n(&c.world_to_camera[0], 12, 0.0); },
            "its rotation is singular");
    refuses([](Camera& c) { std::copy_n(&c.world_to_camera[0], 3, &c.world_to_camera[4]); },
            "singular (determinant");
    const std::vector<scene::Camera> two(2, camera_of(scene));
    EXPECT_ERROR(session.forward(two), Code::kInvalidArgument, "2 cameras, expected at most 1");
    // The previous call is still the latest that succeeded.
    EXPECT_OK(session.backward(std::vector<float>(image.size(), 1.0F)));
}

TEST_P(Rasterizer, RefusesBackwardWithoutForward) {
    const RasterCase scene = random_scene(kSmall, 3);
    const std::vector<float> ones(4 * scene.pixels(), 1.0F);
    RasterSession forward_only(context(), scene, small_desc());
    ASSERT_OK(forward_only);
    ASSERT_OK(forward_only.forward());
    EXPECT_ERROR(forward_only.backward(ones), Code::kInvalidArgument, "made without backward");
    RasterSession session(context(), scene, with_gradients(small_desc()));
    ASSERT_OK(session);
    const std::vector<float> before = session.gradients();
    EXPECT_ERROR(session.backward(ones), Code::kInvalidArgument, "needs a forward call");
    const std::vector<float> after = session.gradients();
    EXPECT_TRUE(std::memcmp(before.data(), after.data(), before.size() * 4) == 0);
    ASSERT_OK(session.forward());
    EXPECT_OK(session.backward(ones));
    EXPECT_OK(session.backward(ones)) << "twice after one forward call";
}

/// Every pixel is the background and gradients are zeros, so nothing of the poisoned memory is
/// used.
void expect_background(vk::Context& context, const RasterCase& scene) {
    for (const RasterMode& mode : kRasterModes) {
        RasterSession session(context, scene, with_gradients(raster_desc(scene, mode)));
        ASSERT_OK(session);
        ASSERT_OK(session.forward());
        const std::vector<float> image = session.image();
        for (std::size_t i = 0; i < image.size(); ++i)
            ASSERT_EQ(image[i], i % 4 == 3 ? 0.0F : scene.background[i % 4]) << scene.name;
        const raster::RasterStats& stats = session.rasterizer().stats();
        EXPECT_EQ(stats.pairs, 0U);
        EXPECT_EQ(stats.longest, 0U);
        EXPECT_EQ(stats.empty_tiles, stats.tiles);
        ASSERT_OK(session.backward(std::vector<float>(image.size(), 1.0F),
                                   std::vector<float>(image.size() / 4, 1.0F)));
        for (const float g : session.gradients()) ASSERT_EQ(g, 0.0F) << scene.name;
        for (const float g : session.exported()) ASSERT_EQ(g, 0.0F) << scene.name;
        const vk::BufferView pose = session.rasterizer().workspace().pose.range();
        std::array<float, 12> by_pose{};
        ASSERT_OK(context.read(pose, by_pose.data(), sizeof by_pose));
        for (const float g : by_pose) ASSERT_EQ(g, 0.0F) << scene.name;
    }
}

TEST_P(Rasterizer, ShowsTheBackgroundWithoutGaussians) {
    expect_background(context(), empty_scene({0, 37, 21}));
    expect_background(context(), empty_scene({0, 1, 1}));
}

TEST_P(Rasterizer, ShowsTheBackgroundIfAllAreBehindTheCamera) {
    expect_background(context(), empty_scene({300, 37, 21}));
}

TEST_P(Rasterizer, DrawsEverySizeOfImage) {
    const SceneSize sizes[] = {{30, 1, 1},   {30, 1, 40},  {30, 40, 1}, {30, 15, 16},
                               {30, 16, 17}, {30, 17, 15}, {30, 33, 47}};
    for (const SceneSize& size : sizes) {
        SCOPED_TRACE(std::to_string(size.width) + " x " + std::to_string(size.height));
        expect_like_reference(context(), random_scene(size, 5), kRasterModes[0]);
        expect_like_reference(context(), random_scene(size, 6), kRasterModes[1]);
    }
}

/// Writes a mark to the image on the device, which a skipped call leaves there.
class Marked {
  public:
    Marked(vk::Context& context, RasterSession& session) : context_(context), session_(session) {}

    bool drawn_by(const std::function<Status()>& call) {
        EXPECT_OK(context_.fill(session_.rasterizer().workspace().image.range(), 0x3F000000U));
        EXPECT_OK(call());
        const std::vector<float> image = session_.image();
        const bool drawn =
            std::any_of(image.begin(), image.end(), [](float x) { return x != 0.5F; });
        EXPECT_EQ(drawn, session_.rasterizer().stats().runs > 0);
        return drawn;
    }

  private:
    vk::Context& context_;
    RasterSession& session_;
};

TEST_P(Rasterizer, LeavesOutCallsThatChangeNothing) {
    const RasterCase scene = random_scene(kSmall, 3);
    RasterSession session(context(), scene, small_desc());
    ASSERT_OK(session);
    scene::Camera camera = camera_of(scene);
    const auto forward = [&](std::uint64_t version) {
        return [&, version] { return session.forward({&camera, 1}, version); };
    };
    Marked marked(context(), session);
    EXPECT_TRUE(marked.drawn_by(forward(7)));
    EXPECT_FALSE(marked.drawn_by(forward(7)));
    EXPECT_TRUE(marked.drawn_by(forward(8))) << "another version";
    EXPECT_FALSE(marked.drawn_by(forward(8)));
    EXPECT_TRUE(marked.drawn_by(forward(0))) << "a version that is not known";
    EXPECT_TRUE(marked.drawn_by(forward(0))) << "a version that is not known";
    EXPECT_TRUE(marked.drawn_by(forward(8)));
    camera.world_to_camera[3] += 0.01;
    EXPECT_TRUE(marked.drawn_by(forward(8))) << "another pose";
    camera.fx *= 1.01;
    EXPECT_TRUE(marked.drawn_by(forward(8))) << "another lens";
    session.background[1] += 0.25F;
    EXPECT_TRUE(marked.drawn_by(forward(8))) << "another background";
    EXPECT_FALSE(marked.drawn_by(forward(8)));
    camera.fx = -1;
    EXPECT_ERROR(session.forward({&camera, 1}, 8), Code::kInvalidArgument, "focal");
    camera = camera_of(scene);
    EXPECT_TRUE(marked.drawn_by(forward(8)));
    auto other = need(PackedCase::create(context(), random_scene(kSmall, 4), small_desc()));
    EXPECT_TRUE(marked.drawn_by([&] {
        gaussians::SetViews others = other.scene.views();
        others.version = 8;
        return session.draw(others, {&camera, 1});
    })) << "another scene of the same version";
}

TEST_P(Rasterizer, DrawsEveryCallIfAskedTo) {
    const RasterCase scene = random_scene(kSmall, 3);
    raster::RasterDesc desc = small_desc();
    desc.skips.unchanged = false;
    RasterSession session(context(), scene, desc);
    ASSERT_OK(session);
    Marked marked(context(), session);
    EXPECT_TRUE(marked.drawn_by([&] { return session.forward(7); }));
    EXPECT_TRUE(marked.drawn_by([&] { return session.forward(7); }));
}

TEST(Conics, UndoTheFactor) {
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

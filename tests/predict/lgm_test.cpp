// What LGM's network sees, and scenes of its predictions.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "config/heads.h"
#include "io/scene_file.h"
#include "model/model.h"
#include "predict/lgm_views.h"
#include "predict/pictures.h"
#include "predict/predictor.h"
#include "scene/camera_pose.h"
#include "support/expect_status.h"
#include "support/gpu_env.h"
#include "support/rng_fill.h"

namespace splat::predict {
namespace {

using scene::Vec3;

/// Two levels of 32 and 16 pixels; Gaussians of 32 x 32 pixels of each view.
config::ModelConfig small_lgm() {
    config::ModelConfig c;
    config::take_head(config::kHeads[2], c);
    c.network = config::Network::kLgmUnet;
    c.lgm = {{32, 64}, {64, 32}, {0, 1}, {1, 0}};
    c.views = 4;
    c.resolution = 32;
    c.fov_degrees = 49.1F;
    c.znear = 0.5F;
    c.zfar = 2.5F;
    return c;
}

PictureInput view_of_shade(std::uint32_t side = 40, std::uint16_t shade = 100) {
    io::Image image;
    image.width = image.height = side;
    image.channels = 3;
    for (std::uint32_t i = 0; i < 3 * side * side; ++i)
        image.samples.push_back(static_cast<std::uint16_t>(shade + i % 7));
    PictureInput input;
    input.picture.image = {std::move(image), "a picture", {}};
    input.crop = false;
    return input;
}

Result<PictureViews> lgm_views_of(std::vector<PictureInput> pictures) {
    return views_of_pictures(small_lgm(), {1, 1, 1}, pictures);
}

std::vector<PictureInput> four_views() {
    return {view_of_shade(), view_of_shade(40, 120), view_of_shade(40, 140),
            view_of_shade(40, 160)};
}

/// kiui's orbit_camera(elevation 0, azimuth): a camera-to-world pose in OpenGL's axes.
struct Orbit {
    Vec3 right, up, back, at;
    explicit Orbit(int view) {
        const double a = view * std::numbers::pi / 2;
        at = {1.5 * std::sin(a), 0, 1.5 * std::cos(a)};
        back = glm::normalize(at);
        up = {0, 1, 0};
        right = glm::cross(up, back);
    }
};

TEST(LgmViews, PlanesAreColoursAndRaysOfTheFourPoses) {
    const PictureViews made = need(lgm_views_of(four_views()));
    const std::size_t r = 32, area = r * r;
    ASSERT_EQ(made.views.inputs.size(), 4 * 9 * area);
    const double f = 16 / std::tan(49.1 / 2 * std::numbers::pi / 180);
    constexpr double kMean[] = {0.485, 0.456, 0.406}, kDeviation[] = {0.229, 0.224, 0.225};
    for (int view = 0; view < 4; ++view) {
        const Orbit pose(view);
        const float* const planes =
            made.views.inputs.data() + static_cast<std::size_t>(view) * 9 * area;
        for (const std::size_t p : {std::size_t{0}, std::size_t{37}, area - 3}) {
            const double x = (static_cast<double>(p % r) + 0.5 - 16) / f;
            const double y = -(static_cast<double>(p / r) + 0.5 - 16) / f;
            const Vec3 d = glm::normalize(x * pose.right + y * pose.up - pose.back);
            const Vec3 moment = glm::cross(pose.at, d);
            for (int k = 0; k < 3; ++k) {
                const auto at = [&](int plane) {
                    return static_cast<double>(planes[static_cast<std::size_t>(plane) * area + p]);
                };
                EXPECT_NEAR(at(3 + k), moment[k], 1e-6) << view << " " << p;
                EXPECT_NEAR(at(6 + k), d[k], 1e-6) << view << " " << p;
                const double shade = static_cast<double>(
                    made.views
                        .images[(3 * static_cast<std::size_t>(view) + static_cast<std::size_t>(k)) *
                                    area +
                                p]);
                EXPECT_NEAR(at(k), (shade - kMean[k]) / kDeviation[k], 1e-5);
            }
        }
    }
}

TEST(LgmViews, CamerasLookAtTheOriginFromFourSides) {
    const PictureViews made = need(lgm_views_of(four_views()));
    const Vec3 expected[] = {{0, 0, -1.5}, {1.5, 0, 0}, {0, 0, 1.5}, {-1.5, 0, 0}};
    ASSERT_EQ(made.views.cameras.size(), 4U);
    for (std::size_t i = 0; i < 4; ++i)
        EXPECT_NEAR(glm::length(scene::camera_center(made.views.cameras[i]) - expected[i]), 0, 1e-6)
            << i;
}

/// Poses of the caller give the same as those that are taken without: only their relation counts.
TEST(LgmViews, GivenPosesAreRelativeToTheFirst) {
    std::vector<PictureInput> pictures = four_views();
    const std::vector<scene::Mat4> poses = poses_around(small_lgm(), 4);
    for (std::size_t i = 0; i < 4; ++i)
        pictures[i].world_to_camera = scene::inverse_of_rigid(scene::inverse_of_rigid(poses[i]));
    const PictureViews given = need(lgm_views_of(pictures)), own = need(lgm_views_of(four_views()));
    for (std::size_t i = 0; i < own.views.inputs.size(); ++i)
        ASSERT_NEAR(given.views.inputs[i], own.views.inputs[i], 1e-6) << i;
    pictures[2].world_to_camera.reset();
    EXPECT_ERROR(lgm_views_of(pictures), Code::kInvalidArgument,
                 "pictures[2]: a pose is missing, unlike that of pictures[0]");
}

TEST(LgmViews, RefusesWhatIsNotFourViewsOfOneSize) {
    EXPECT_ERROR(lgm_views_of({view_of_shade()}), Code::kInvalidArgument,
                 "1 picture, expected 4: LGM's network takes views of one object from the front, "
                 "the right, the back and the left");
    std::vector<PictureInput> pictures = four_views();
    pictures[3] = view_of_shade(48);
    EXPECT_ERROR(lgm_views_of(pictures), Code::kInvalidArgument,
                 "pictures[3] has 48 x 48 pixels, expected 40 x 40 as pictures[0]");
    pictures = four_views();
    pictures[1].crop = true;
    EXPECT_ERROR(lgm_views_of(pictures), Code::kInvalidArgument,
                 "one of 4 views is to be cut out, expected whole pictures");
}

class LgmPredictor : public testing::Test {
  protected:
    void SetUp() override {
        context_ = test::shared_context();
        settings_.network = small_lgm();
        predictor_ = need(Predictor::create(*context_, settings_));
        EXPECT_OK(predictor_->model().init(3));
    }
    vk::Context* context_ = nullptr;
    config::Settings settings_;
    std::unique_ptr<Predictor> predictor_;
};

/// Direct colours become coefficients of degree 0 once, and a file of the scene shows what the network meant.
TEST_F(LgmPredictor, SceneOfAFileIsDrawnAsThePrediction) {
    const PictureViews pictures = need(lgm_views_of(four_views()));
    ASSERT_OK(predictor_->predict(pictures.views));
    const auto images = need(predictor_->draw(pictures.views.cameras));
    const auto made = need(predictor_->scene());
    ASSERT_GT(made.gaussians.count(), 4000U);
    EXPECT_EQ(made.gaussians.sh_degree, 0U);
    const auto* const format = need(io::written_scene_format("scene.ply"));
    const io::Buffer file = need(io::write_scene(made.gaussians, *format));
    const auto loaded = need(io::read_scene(file, "scene.ply"));
    gaussians::SetDesc desc;
    desc.gaussians = static_cast<std::uint32_t>(loaded.gaussians.count());
    auto set = need(gaussians::allocate_set(*context_, desc));
    ASSERT_OK(gaussians::upload(*context_, loaded.gaussians, set));
    raster::RasterDesc drawn;
    static_cast<gaussians::SetDesc&>(drawn) = desc;
    drawn.views = 4;
    drawn.width = drawn.height = 32;
    const auto rasterizer = need(raster::Rasterizer::create(*context_, drawn));
    const auto packed =
        need(raster::pack_views(rasterizer->desc(), pictures.views.cameras, {1, 1, 1}));
    ASSERT_OK(rasterizer->forward(set.views(), packed));
    const std::size_t area = std::size_t{32} * 32;
    std::vector<float> quads(4 * 4 * area);
    ASSERT_OK(context_->read(rasterizer->workspace().image.range(), quads.data(),
                             quads.size() * sizeof(float)));
    double least = 1, worst = 0;
    for (std::size_t i = 0; i < 4 * area; ++i)
        for (std::size_t c = 0; c < 3; ++c) {
            const float before = images[(3 * (i / area) + c) * area + i % area];
            least = std::min(least, static_cast<double>(before));
            worst = std::max(worst, std::abs(static_cast<double>(quads[4 * i + c] - before)));
        }
    EXPECT_LT(least, 0.9) << "nothing is drawn before the white background";
    EXPECT_LT(worst, 1e-4);
}

/// Each view counts, and the frame is that of scenes: what the network puts up is up.
TEST_F(LgmPredictor, AllViewsAreSeen) {
    const PictureViews pictures = need(lgm_views_of(four_views()));
    ASSERT_OK(predictor_->predict(pictures.views));
    const auto before = need(predictor_->scene());
    PictureViews other = pictures;
    const std::size_t plane = std::size_t{32} * 32;
    for (std::size_t i = 0; i < 3 * plane; ++i) other.views.inputs[3 * 9 * plane + i] += 1;
    ASSERT_OK(predictor_->predict(other.views));
    const auto after = need(predictor_->scene());
    ASSERT_EQ(after.gaussians.count(), before.gaussians.count());
    EXPECT_NE(after.gaussians.means[0], before.gaussians.means[0])
        << "the first view attends to the fourth";
}

}  // namespace
}  // namespace splat::predict

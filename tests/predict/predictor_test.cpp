#include "predict/predictor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "model/adapters.h"
#include "model/small_model.h"
#include "scene/activate.h"
#include "scene/camera_pose.h"
#include "support/expect_status.h"

namespace splat::predict {
namespace {

/// A small network with random weights, and a picture.
class PredictorTest : public testing::Test {
  protected:
    void SetUp() override {
        context_ = test::shared_context();
        settings_.network = test::small_config();
    }
    io::WeightsFile weights(const config::ModelConfig& config) {
        auto made = need(model::Model::create(*context_, config, {}));
        EXPECT_OK(made->init(7));
        std::uint64_t seed = 1;
        for (const nn::Parameter& parameter : made->parameters().all())
            EXPECT_OK(made->parameters().write(
                parameter, test::normal_fill(parameter.shape.elements(), seed++, 0, 0.1)));
        auto state = need(model::save_state(*made));
        io::WeightsFile file;
        file.tensors = std::move(state);
        return file;
    }
    std::unique_ptr<Predictor> predictor(const io::WeightsFile& file) {
        auto made = need(Predictor::create(*context_, settings_));
        model::LoadReport report;
        EXPECT_OK(made->load(file, report));
        return made;
    }
    [[nodiscard]] Views picture() const {
        Views views;
        views.inputs = test::Inputs(settings_.network).images;
        return views;
    }

    /// The camera of a first view: at the origin, looking along z.
    [[nodiscard]] scene::Camera camera() const {
        return scene::camera_from_fov(
                   settings_.network.resolution, settings_.network.resolution,
                   static_cast<double>(settings_.network.fov_degrees) * std::numbers::pi / 180)
            .value();
    }

    vk::Context* context_ = nullptr;
    config::Settings settings_;
};

TEST_F(PredictorTest, PredictsTheOutputsOfItsModel) {
    const auto made = predictor(weights(settings_.network));
    ASSERT_OK(made->predict(picture()));
    const scene::Gaussians scene =
        need(gaussians::download(*context_, made->model().set_desc(), made->model().set(0), true))
            .gaussians;
    ASSERT_EQ(scene.count(), 256U);
    std::vector<float> means(3 * 256), scales(3 * 256), opacities(256);
    const auto outputs = made->model().outputs().value();
    EXPECT_OK(context_->read(outputs.means, means.data(), means.size() * 4));
    EXPECT_OK(context_->read(outputs.scales, scales.data(), scales.size() * 4));
    EXPECT_OK(context_->read(outputs.opacities, opacities.data(), opacities.size() * 4));
    EXPECT_EQ(scene.means, means);
    for (std::size_t i = 0; i < scales.size(); ++i)
        EXPECT_EQ(scene.log_scales[i], static_cast<float>(std::log(double{scales[i]}))) << i;
    for (std::size_t i = 0; i < 256; ++i)
        EXPECT_NEAR(scene::opacity_of(static_cast<double>(scene.opacity_logits[i])), opacities[i],
                    1e-6);
}

TEST_F(PredictorTest, RefusesInputsOfAnotherSize) {
    const auto made = predictor(weights(settings_.network));
    Views views = picture();
    views.inputs.pop_back();
    EXPECT_ERROR(made->predict(views), Code::kShape, "images");
}

TEST_F(PredictorTest, DrawsAnyNumberOfCamerasToTheSameImages) {
    const auto made = predictor(weights(settings_.network));
    ASSERT_OK(made->predict(picture()));
    std::vector<scene::Camera> cameras;
    for (std::uint32_t i = 0; i < Predictor::kDrawnAtOnce; ++i) {
        cameras.push_back(camera());
        cameras.back().world_to_camera[3] = 0.02 * i;
    }
    const auto images = need(made->draw(cameras));
    const std::size_t plane = std::size_t{3} * 16 * 16;
    ASSERT_EQ(images.size(), cameras.size() * plane);
    for (const std::size_t i : {std::size_t{0}, std::size_t{7}, std::size_t{15}}) {
        const auto one = need(made->draw(std::span(cameras).subspan(i, 1)));
        EXPECT_TRUE(std::equal(one.begin(), one.end(),
                               images.begin() + static_cast<std::ptrdiff_t>(i * plane)))
            << i;
    }
    EXPECT_TRUE(made->draw({}).value().empty());
}

TEST_F(PredictorTest, DrawsTheLatestPrediction) {
    const auto made = predictor(weights(settings_.network));
    const scene::Camera camera = this->camera();
    const auto drawn = [&](const Views& views) {
        EXPECT_OK(made->predict(views));
        return made->draw(std::span(&camera, 1)).value();
    };
    Views other = picture();
    for (float& value : other.inputs) value = 1 - value;
    const std::vector<float> before = drawn(picture());
    EXPECT_NE(drawn(other), before);
    EXPECT_EQ(drawn(picture()), before);
}

TEST_F(PredictorTest, FoldsTheAdaptersOfItsWeights) {
    settings_.network.lora.rank = 2;
    settings_.network.lora.alpha = 3;
    const io::WeightsFile file = weights(settings_.network);
    io::WeightsFile folded;
    auto merged = need(model::merge_adapters(file.tensors, file.tensors, 3, 1));
    folded.tensors = std::move(merged);
    const auto adapted = predictor(file);
    settings_.network.lora = {};
    const auto plain = predictor(folded);
    ASSERT_OK(adapted->predict(picture()));
    ASSERT_OK(plain->predict(picture()));
    const auto a = need(adapted->scene());
    const auto b = need(plain->scene());
    EXPECT_GT(a.gaussians.count(), 0U);
    EXPECT_EQ(a.gaussians.means, b.gaussians.means);
    EXPECT_EQ(a.gaussians.sh, b.gaussians.sh);
}

TEST_F(PredictorTest, TellsAnOutputThatIsNotFinite) {
    io::WeightsFile file = weights(settings_.network);
    const auto sound = predictor(file);
    ASSERT_OK(sound->predict(picture()));
    EXPECT_EQ(sound->ledger().outputs_not_finite, 0U);
    io::WeightsFile huge;
    for (io::NamedTensor tensor : file.tensors) {
        if (tensor.name.find("aux_conv") != std::string::npos)
            for (float& value : tensor.values.own()) value = 3.4e38F;
        ASSERT_OK(huge.tensors.add(std::move(tensor)));
    }
    const auto broken = predictor(huge);
    ASSERT_OK(broken->predict(picture()));
    EXPECT_GT(broken->ledger().outputs_not_finite, 0U);
}

/// A small network with the inputs of F3D-Gaus.
config::ModelConfig orbit_network() {
    config::ModelConfig config = test::small_config();
    config.positions = kHeadInputDepth;
    config.mask = true;
    config.fov_degrees = 13.164F;
    config.znear = 6.667F;
    config.zfar = 8.667F;
    config.init_opacity = {0.1F, 1};
    config.init_scale = {0.01F, 0.3F};
    return config;
}

/// The first camera and those of the orbit look at the middle of the depths from the same distance.
TEST_F(PredictorTest, AggregationLooksFromAnOrbit) {
    const config::ModelConfig config = orbit_network();
    const auto cameras = need(orbit_of_aggregation(config, 8));
    ASSERT_EQ(cameras.size(), 8U);
    for (const scene::Camera& camera : cameras) {
        const scene::Vec3 middle(0, 0, 7.667);
        const scene::Vec3 at = scene::rotation_of(camera.world_to_camera) * middle +
                               scene::translation_of(camera.world_to_camera);
        EXPECT_NEAR(glm::length(at - middle), 0, 1e-5);
    }
    const scene::Vec3 first = scene::camera_center(cameras[0]);
    EXPECT_NEAR(first.x, 0, 1e-9);
    EXPECT_NEAR(first.y, -7.667 * std::sin(0.15), 1e-5);
    EXPECT_NEAR(glm::length(scene::camera_center(cameras[7]) - first), 0, 1e-9) << "a whole turn";
    EXPECT_NEAR(scene::camera_center(cameras[2]).x,
                7.667 * std::sin(0.25 * std::sin(4 * std::numbers::pi / 7)) *
                    std::cos(0.15 * std::cos(4 * std::numbers::pi / 7)),
                1e-5);
}

TEST_F(PredictorTest, AggregationJoinsWhatDrawnViewsGive) {
    settings_.network = orbit_network();
    auto plain = need(model::Model::create(*context_, settings_.network, {}));
    EXPECT_OK(plain->init(7));
    io::WeightsFile file;
    file.tensors = need(model::save_state(*plain));
    const auto made = predictor(file);
    Views views = picture();
    const std::size_t area = std::size_t{16} * 16;
    for (std::size_t i = 0; i < area; ++i) {
        views.inputs[3 * area + i] = 1;
        views.inputs[4 * area + i] = 7.5F;
    }
    EXPECT_OK(made->predict(views));
    const auto one = need(made->scene());
    ASSERT_GT(one.gaussians.count(), 200U);
    const auto all = need(made->aggregate(views, {.views = 3}));
    EXPECT_EQ(all.gaussians.count() + all.faint + all.not_finite, 4 * area);
    EXPECT_GT(all.gaussians.count(), 3 * one.gaussians.count());
    EXPECT_TRUE(std::equal(one.gaussians.means.begin(), one.gaussians.means.end(),
                           all.gaussians.means.begin()))
        << "those of the picture come first, as they were";
    // Drawn depths put the other views' Gaussians where the picture's are.
    double depth = 0;
    const std::size_t rest = all.gaussians.count() - one.gaussians.count();
    for (std::size_t i = one.gaussians.count(); i < all.gaussians.count(); ++i)
        depth += static_cast<double>(all.gaussians.means[3 * i + 2]) / static_cast<double>(rest);
    EXPECT_NEAR(depth, 7.5, 0.3);
    const auto again = need(made->aggregate(views, {.views = 3}));
    EXPECT_EQ(again.gaussians.means, all.gaussians.means) << "the same bits";
    const auto ray = need(made->aggregate(views, {3, raster::Convention::kRayMaximum}));
    EXPECT_EQ(ray.gaussians.count() + ray.faint + ray.not_finite, 4 * area);
    EXPECT_NE(ray.gaussians.means, all.gaussians.means) << "views are drawn by another rule";
    EXPECT_ERROR(made->aggregate(views, {.views = 1}), Code::kInvalidArgument,
                 "aggregation over 1 views, expected 0, or 2 to 64");
    EXPECT_ERROR(check_aggregation(test::small_config(), 8), Code::kInvalidArgument,
                 "the network must take one picture of colours and mask, and depths for its head");
}

TEST_F(PredictorTest, ScenesLeaveOutWhatIsBelowTheThreshold) {
    const io::WeightsFile file = weights(settings_.network);
    const auto usual = predictor(file);
    EXPECT_OK(usual->predict(picture()));
    const auto all = need(usual->scene());
    std::vector<float> logits = all.gaussians.opacity_logits;
    std::ranges::sort(logits);
    const double middle = scene::opacity_of(static_cast<double>(logits[logits.size() / 2]));
    settings_.network.opacity_threshold = static_cast<float>(middle);
    const auto strict = predictor(file);
    EXPECT_OK(strict->predict(picture()));
    const auto some = need(strict->scene());
    EXPECT_LT(some.gaussians.count(), all.gaussians.count());
    EXPECT_GT(some.gaussians.count(), 0U);
    EXPECT_EQ(some.gaussians.count() + some.faint, all.gaussians.count() + all.faint);
    for (const float logit : some.gaussians.opacity_logits)
        EXPECT_GE(scene::opacity_of(static_cast<double>(logit)), middle - 1e-6);
}

}  // namespace
}  // namespace splat::predict

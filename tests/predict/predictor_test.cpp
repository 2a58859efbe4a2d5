#include "predict/predictor.h"

#include <gtest/gtest.h>

#include "model/adapters.h"
#include "model/small_model.h"
#include "scene/activate.h"
#include "support/expect_status.h"

namespace splat::predict {
namespace {

/// A small network with random weights, and a picture.
class PredictorTest : public testing::Test {
  protected:
    void SetUp() override {
        context_ = test::shared_context();
        ASSERT_NE(context_, nullptr);
        settings_.network = test::small_config();
    }
    io::WeightsFile weights(const config::ModelConfig& config) {
        auto made = model::Model::create(*context_, config, {});
        EXPECT_OK(made.status());
        EXPECT_OK(made.value()->init(7));
        std::uint64_t seed = 1;
        for (const nn::Parameter& parameter : made.value()->parameters().all())
            EXPECT_OK(made.value()->parameters().write(
                parameter, test::normal_fill(parameter.shape.elements(), seed++, 0, 0.1)));
        auto state = model::save_state(*made.value());
        EXPECT_OK(state.status());
        io::WeightsFile file;
        file.tensors = std::move(state.value());
        return file;
    }
    std::unique_ptr<Predictor> predictor(const io::WeightsFile& file) {
        auto made = Predictor::create(*context_, settings_);
        EXPECT_OK(made.status());
        model::LoadReport report;
        EXPECT_OK(made.value()->load(file, report));
        return std::move(made.value());
    }
    [[nodiscard]] Views picture() const {
        Views views;
        views.inputs = test::Inputs(settings_.network).images;
        return views;
    }

    vk::Context* context_ = nullptr;
    config::Settings settings_;
};

TEST_F(PredictorTest, PredictsTheOutputsOfItsModel) {
    const auto made = predictor(weights(settings_.network));
    const auto scene = made->predict(picture());
    ASSERT_OK(scene.status());
    ASSERT_EQ(scene.value().count(), 256U);
    std::vector<float> means(3 * 256), scales(3 * 256), opacities(256);
    const auto outputs = made->model().outputs();
    EXPECT_OK(context_->read(outputs.means, means.data(), means.size() * 4));
    EXPECT_OK(context_->read(outputs.scales, scales.data(), scales.size() * 4));
    EXPECT_OK(context_->read(outputs.opacities, opacities.data(), opacities.size() * 4));
    EXPECT_EQ(scene.value().means, means);
    for (std::size_t i = 0; i < scales.size(); ++i)
        EXPECT_EQ(scene.value().log_scales[i], std::log(scales[i])) << i;
    for (std::size_t i = 0; i < 256; ++i)
        EXPECT_NEAR(scene::opacity_of(static_cast<double>(scene.value().opacity_logits[i])),
                    static_cast<double>(opacities[i]), 1e-6);
}

TEST_F(PredictorTest, RefusesInputsOfAnotherSize) {
    const auto made = predictor(weights(settings_.network));
    Views views = picture();
    views.inputs.pop_back();
    EXPECT_ERROR(made->predict(views).status(), Code::kShape, "images");
}

TEST_F(PredictorTest, DrawsManyCamerasInGroupsOfTheSameImages) {
    const auto made = predictor(weights(settings_.network));
    const auto scene = made->predict(picture());
    ASSERT_OK(scene.status());
    std::vector<scene::Camera> cameras;
    for (int i = 0; i < 18; ++i) {
        cameras.push_back(made->camera().value());
        cameras.back().world_to_camera[3] = 0.02 * i;
    }
    const auto images = made->draw(scene.value(), cameras);
    ASSERT_OK(images.status());
    const std::size_t plane = std::size_t{3} * 16 * 16;
    ASSERT_EQ(images.value().size(), 18 * plane);
    for (const std::size_t i : {std::size_t{0}, std::size_t{15}, std::size_t{17}}) {
        const auto one = made->draw(std::span(cameras).subspan(i, 1));
        ASSERT_OK(one.status());
        EXPECT_TRUE(std::equal(one.value().begin(), one.value().end(),
                               images.value().begin() + static_cast<std::ptrdiff_t>(i * plane)))
            << i;
    }
}

TEST_F(PredictorTest, DrawsTheSceneThatWasShownLast) {
    settings_.training.white_background = false;
    const auto made = predictor(weights(settings_.network));
    auto scene = made->predict(picture());
    ASSERT_OK(scene.status());
    const scene::Camera camera = made->camera().value();
    const auto before = made->draw(scene.value(), std::span(&camera, 1));
    for (float& logit : scene.value().opacity_logits) logit = -20;
    const auto faint = made->draw(scene.value(), std::span(&camera, 1));
    ASSERT_OK(before.status());
    ASSERT_OK(faint.status());
    EXPECT_NE(before.value(), faint.value());
    EXPECT_EQ(faint.value(), std::vector<float>(faint.value().size(), 0.0F));
    const auto depth = made->draw_depth(scene.value(), camera);
    ASSERT_OK(depth.status());
    EXPECT_EQ(depth.value().alpha, std::vector<float>(256, 0.0F));
}

TEST_F(PredictorTest, FoldsTheAdaptersOfItsWeights) {
    settings_.network.lora.rank = 2;
    settings_.network.lora.alpha = 3;
    const io::WeightsFile file = weights(settings_.network);
    io::WeightsFile folded;
    auto merged = model::merge_adapters(file.tensors, file.tensors, 3, 1);
    ASSERT_OK(merged.status());
    folded.tensors = std::move(merged.value());
    const auto adapted = predictor(file)->predict(picture());
    settings_.network.lora = {};
    const auto plain = predictor(folded)->predict(picture());
    ASSERT_OK(adapted.status());
    ASSERT_OK(plain.status());
    EXPECT_EQ(adapted.value().means, plain.value().means);
    EXPECT_EQ(adapted.value().sh, plain.value().sh);
}

TEST_F(PredictorTest, TellsAnOutputThatIsNotFinite) {
    io::WeightsFile file = weights(settings_.network);
    const auto sound = predictor(file);
    ASSERT_OK(sound->predict(picture()).status());
    EXPECT_TRUE(sound->finite_output().value());
    io::WeightsFile huge;
    for (io::NamedTensor tensor : file.tensors) {
        if (tensor.name.find("aux_conv") != std::string::npos)
            for (float& value : tensor.values.own()) value = 3.4e38F;
        ASSERT_OK(huge.tensors.add(std::move(tensor)));
    }
    const auto broken = predictor(huge);
    ASSERT_OK(broken->predict(picture()).status());
    EXPECT_FALSE(broken->finite_output().value());
}

TEST_F(PredictorTest, HasNoCameraWithoutAFieldOfView) {
    settings_.network.fov_degrees = 0;
    auto made = Predictor::create(*context_, settings_);
    ASSERT_OK(made.status());
    EXPECT_ERROR(made.value()->camera().status(), Code::kInvalidArgument, "'data.fov' is 0");
}

}  // namespace
}  // namespace splat::predict

#include "eval/evaluator.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <thread>

#include "model/small_model.h"
#include "support/expect_status.h"
#include "synthetic/sample_folder.h"

namespace splat::eval {
namespace {

/// A network with weights of one size, and procedural cars.
class EvaluatorTest : public testing::Test {
  protected:
    void SetUp() override {
        context_ = test::shared_context();
        synthetic::WriterDesc cars = test::sample_cars(folder_ / "cars");
        cars.resolution = 16;
        test::write_all(cars);
        settings_.network = test::small_config();
        settings_.training.root = cars.path;
        auto made = need(predict::Predictor::create(*context_, settings_));
        network_ = std::move(made);
    }
    void fill(float weight) {
        nn::Parameters& parameters = network_->model().parameters();
        for (const nn::Parameter& parameter : parameters.all())
            ASSERT_OK(parameters.write(parameter,
                                       std::vector<float>(parameter.shape.elements(), weight)));
    }
    Evaluator evaluator(bool network = true, Protocol protocol = {}) {
        auto data = need(predict::ViewSource::open(settings_, "", "test"));
        Evaluation labels;
        labels.method = network ? "" : "mine";
        Evaluator made(std::move(data), std::move(protocol), {}, labels);
        if (network) {
            EXPECT_OK(made.use(*context_, *network_));
        }
        return made;
    }

    /// The first view's inputs, with a full group of cameras and a part of one.
    predict::Views many_views() {
        Evaluator made = evaluator(false);
        predict::Views views = need(made.read(0));
        const scene::Camera first = views.cameras[0];
        views.cameras.assign(predict::Predictor::kDrawnAtOnce + 4, first);
        for (std::size_t i = 0; i < views.cameras.size(); ++i)
            views.cameras[i].world_to_camera[3] += 0.01 * static_cast<double>(i);
        return views;
    }
    /// A prediction, and the images of its cameras, each drawn alone.
    std::vector<float> drawn_alone(const predict::Views& views) {
        EXPECT_OK(network_->predict(views));
        std::vector<float> images;
        for (const scene::Camera& camera : views.cameras) {
            const auto image = need(network_->draw(std::span(&camera, 1)));
            images.insert(images.end(), image.begin(), image.end());
        }
        return images;
    }

    test::SampleFolder folder_;
    vk::Context* context_ = nullptr;
    config::Settings settings_;
    std::unique_ptr<predict::Predictor> network_;
};

TEST_F(EvaluatorTest, ScoresWhatItDraws) {
    ASSERT_NO_FATAL_FAILURE(fill(0.01F));
    Evaluator made = evaluator();
    ASSERT_EQ(made.objects(), 1U);
    const ObjectScores s = need(made.score(0));
    EXPECT_EQ(s.conditioning.views, 1U);
    EXPECT_EQ(s.novel.views, 3U);
    EXPECT_TRUE(std::isnan(s.novel.lpips));
    EXPECT_TRUE(s.ledger.finite());
    EXPECT_EQ(s.ledger.gaussians, 256U);
    EXPECT_EQ(s.ledger.invisible + s.ledger.visible, 256U);
    const std::size_t plane = std::size_t{3} * 16 * 16;
    ASSERT_EQ(made.drawn().size(), 4 * plane);
    const auto views = need(made.read(0));
    double psnr = 0;
    for (std::size_t i = 1; i < 4; ++i)
        psnr += compare_images(std::span(made.drawn()).subspan(i * plane, plane),
                               std::span(views.images).subspan(i * plane, plane), 3, 16, 16)
                    .value()
                    .psnr /
                3;
    EXPECT_NEAR(s.novel.psnr, psnr, 1e-9);
    EXPECT_EQ(made.evaluation().objects.size(), 1U);
    EXPECT_ERROR(made.score(1), Code::kInvalidArgument, "object 1 does not exist");
}

TEST_F(EvaluatorTest, DrawsMoreCamerasThanOneGroup) {
    ASSERT_NO_FATAL_FAILURE(fill(0.01F));
    const predict::Views views = many_views();
    ObjectScores scores;
    EXPECT_EQ(need(draw_object(*context_, *network_, views, scores)), drawn_alone(views));
    EXPECT_EQ(scores.drawn, 20U);
    EXPECT_EQ(scores.ledger.gaussians, 256U);
}

TEST_F(EvaluatorTest, ShortSubmitsGiveTheSameImages) {
    ASSERT_NO_FATAL_FAILURE(fill(0.01F));
    const predict::Views views = many_views();
    ObjectScores scores;
    const auto expected = need(draw_object(*context_, *network_, views, scores));
    vk::ContextDesc desc = test::context_desc();
    desc.device.max_submit_ns = 2'000'000;
    const auto brief = test::make_context(desc);
    auto other = need(predict::Predictor::create(*brief, settings_));
    std::swap(network_, other);
    ASSERT_NO_FATAL_FAILURE(fill(0.01F));
    std::swap(network_, other);
    EXPECT_EQ(need(draw_object(*brief, *other, views, scores)), expected);
    const vk::Pace& pace = brief->device().pace;
    if (!pace.watched()) {
        EXPECT_LE(pace.longest_estimate(), pace.submit_seconds());
    }
}

/// Predicts another picture when the mutex is free, which is where draw_object() lets others in.
struct OtherPrediction : vk::DeferredWork {
    OtherPrediction(predict::Predictor& taken, const predict::Views& given, std::atomic<int>& done)
        : predictor(taken), views(given), count(done) {}
    ~OtherPrediction() override {
        EXPECT_OK(predictor.predict(views));
        ++count;
    }
    predict::Predictor& predictor;
    const predict::Views& views;
    std::atomic<int>& count;
};

TEST_F(EvaluatorTest, DrawsItsObjectBesideOtherPredictions) {
    ASSERT_NO_FATAL_FAILURE(fill(0.01F));
    const predict::Views views = many_views();
    predict::Views other = views;
    for (float& value : other.inputs) value = 1 - value;
    const std::vector<float> expected = drawn_alone(views);
    ASSERT_NE(drawn_alone(other), expected);
    std::atomic<bool> drawn = false;
    std::atomic<int> predictions = 0;
    std::jthread beside([&] {
        while (!drawn) {
            const int before = predictions;
            context_->mutex.defer(std::make_unique<OtherPrediction>(*network_, other, predictions));
            while (predictions == before) std::this_thread::yield();
        }
    });
    while (predictions == 0) std::this_thread::yield();
    ObjectScores scores;
    const auto images = need(draw_object(*context_, *network_, views, scores));
    drawn = true;
    EXPECT_EQ(images, expected);
    EXPECT_GT(predictions, 1);
}

TEST_F(EvaluatorTest, WeightsThatOverflowHaveNoScore) {
    ASSERT_NO_FATAL_FAILURE(fill(3.4e38F));
    Evaluator made = evaluator();
    const auto scores = need(made.score(0));
    EXPECT_GT(scores.ledger.outputs_not_finite, 0U);
    EXPECT_TRUE(std::isnan(scores.novel.psnr));
    EXPECT_TRUE(std::isnan(scores.novel.ssim));
    EXPECT_EQ(scores.novel.views, 3U);
    EXPECT_TRUE(std::isnan(summary_of(made.evaluation()).conditioning.psnr));
}

TEST_F(EvaluatorTest, ScoresImagesOfTheCaller) {
    Evaluator made = evaluator(false);
    EXPECT_ERROR(made.score(0), Code::kInvalidState, "no network");
    auto views = need(made.read(0));
    std::vector<float>& images = views.images;
    const auto perfect = need(made.score_images(0, images));
    EXPECT_EQ(perfect.novel.perfect, 3U);
    EXPECT_EQ(perfect.novel.ssim, 1);
    ASSERT_EQ(perfect.novel_views.size(), 3U);
    EXPECT_EQ(perfect.novel_views[2].view, need(made.views(0)).novel[2]);
    EXPECT_EQ(perfect.novel_views[2].psnr, INFINITY);
    EXPECT_EQ(perfect.novel_views[2].ssim, 1);
    images[5] = std::nanf("");
    const auto broken = need(made.score_images(0, images));
    EXPECT_EQ(broken.ledger.images_not_finite, 1U);
    EXPECT_TRUE(std::isnan(broken.novel.ssim));
    EXPECT_TRUE(std::isnan(broken.novel_views[0].psnr));
    images.pop_back();
    EXPECT_ERROR(made.score_images(0, images), Code::kShape, "4 views of 3 x 16 x 16");
}

TEST_F(EvaluatorTest, TakesOtherConditioningViews) {
    ASSERT_NO_FATAL_FAILURE(fill(0.01F));
    Evaluator made = evaluator(true, {.conditioning = {2}, .novel = 1});
    const auto views = need(made.views(0));
    EXPECT_EQ(views.conditioning, std::vector<std::uint32_t>{2});
    EXPECT_EQ(views.novel.size(), 1U);
    EXPECT_EQ(need(made.score(0)).novel.views, 1U);
}

}  // namespace
}  // namespace splat::eval

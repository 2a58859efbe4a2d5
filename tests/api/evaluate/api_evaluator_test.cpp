// Evaluations and comparisons through the C API.
#include <nlohmann/json.hpp>

#include <cmath>
#include <fstream>

#include "api/api_calls.h"

namespace splat::test {
namespace {

using nlohmann::json;

constexpr std::size_t kScoredSide = 16, kScoredPlane = 3 * kScoredSide * kScoredSide;

/// A predictor whose every weight is `value`, except the offsets of its outputs.
Predictor flat_predictor(const Device& device, float value, float offset) {
    const Weights weights = got(splat_model_store, random_model(device));
    const auto count = got(splat_weights_count, weights);
    std::vector<Floats> values(count);
    std::vector<splat_named_array> arrays(count);
    for (std::uint32_t i = 0; i < count; ++i) {
        const auto info = got(splat_weights_get_info, weights, i);
        const std::string name = info.name;
        values[i].assign(info.elements, name.ends_with("out.bias") ? offset : value);
        if (name == "ray_dirs")
            values[i] = floats_of(info.elements, splat_weights_read, weights, i);
        arrays[i] = {info.name, values[i].data(), values[i].size(), {}, info.rank, 0};
        std::copy_n(info.dims, SPLAT_MAX_RANK, arrays[i].dims);
    }
    const Weights flat = got(splat_weights_from_arrays, arrays.data(), arrays.size());
    return make_predictor(device.get(), flat.get());
}

json evaluation_json(splat_evaluator evaluator) {
    return json::parse(text_of(splat_evaluator_report, evaluator));
}

class ApiEvaluator : public testing::Test {
  protected:
    Evaluator evaluator(splat_predictor predictor) {
        auto desc = sized<splat_evaluator_desc>();
        desc.predictor = predictor;
        desc.dataset = dataset_;
        return got(splat_evaluator_create, &desc);
    }

    Device device_ = open_device();
    Predictor predictor_ = make_predictor(device_);
    Dataset dataset_ = make_training_dataset();
};

TEST_F(ApiEvaluator, WhatHasNoEffectIsRefused) {
    auto desc = sized<splat_evaluator_desc>();
    desc.predictor = predictor_;
    desc.dataset = dataset_;
    Evaluator made;
    desc.inputs = 1;
    EXPECT_REFUSED(splat_evaluator_create(&desc, made.out()), kArgument,
                   "splat_evaluator_desc.inputs is 1, expected 0");
    desc.inputs = 0;
    desc.split = "train";
    EXPECT_REFUSED(splat_evaluator_create(&desc, made.out()), kArgument,
                   "splat_evaluator_desc.split is 'train', but dataset is given");
}

TEST_F(ApiEvaluator, JoinedPredictionsAreNotScoredAsSingleOnes) {
    auto network = sized<splat_model_desc>();
    network.config =
        "model: {head: f3d, base_dim: 8, num_blocks: 1, channel_mult: [1, 2], "
        "attention_resolutions: [8]}\ndata: {training_resolution: 16, use_mask: true}";
    const Model model = got(splat_model_create, device_, network);
    ASSERT_DONE(splat_model_init(model, 3));
    const Weights weights = got(splat_model_store, model);
    auto from = sized<splat_predictor_desc>();
    from.weights = weights.get();
    from.config = network.config;
    from.aggregate = 2;
    const Predictor joining = got(splat_predictor_create, device_, from);
    auto desc = sized<splat_evaluator_desc>();
    desc.predictor = joining;
    desc.dataset = dataset_;
    Evaluator made;
    EXPECT_REFUSED(splat_evaluator_create(&desc, made.out()), kArgument,
                   "joins predictions of 2 drawn views");
}

TEST_F(ApiEvaluator, WarnsOfAnotherFieldOfView) {
    const auto warnings = [&](splat_predictor predictor) {
        std::string all;
        const auto hear = [](void* user, splat_log_level, const char* message) {
            *static_cast<std::string*>(user) += message;
        };
        EXPECT_DONE(splat_log_set_callback(hear, &all, SPLAT_LOG_WARNING));
        evaluator(predictor);
        listen_to_log();
        return all;
    };
    EXPECT_EQ(warnings(predictor_), "");
    constexpr const char* kNarrow = "\n  fov: 49";
    const Predictor narrow = make_predictor(device_, make_model(device_, kNarrow), kNarrow);
    EXPECT_TRUE(holds(warnings(narrow), "view is 51.99 degrees, but 'data.fov' is 49"));
}

TEST_F(ApiEvaluator, ScoresObjectsAndSumsUp) {
    const Evaluator made = evaluator(predictor_);
    auto info = got(splat_evaluator_get_info, made);
    EXPECT_EQ(info.objects, 2U);
    EXPECT_EQ(info.scored, 0U);
    EXPECT_EQ(info.resolution, kScoredSide);
    splat_object_scores scores[2] = {sized<splat_object_scores>(), sized<splat_object_scores>()};
    for (std::uint32_t i = 0; i < 2; ++i) ASSERT_DONE(splat_evaluator_score(made, i, &scores[i]));
    EXPECT_STREQ(scores[1].name, "000001_car");
    EXPECT_EQ(scores[1].object, 1U);
    EXPECT_EQ(scores[1].not_finite, 0U);
    EXPECT_EQ(scores[1].novel.views, 2U);
    EXPECT_EQ(scores[1].conditioning.views, 1U);
    EXPECT_TRUE(std::isnan(scores[1].novel.lpips));
    EXPECT_EQ(scores[1].ledger.gaussians, kScoredSide * kScoredSide);
    EXPECT_GT(scores[1].predict_ms, 0);

    const auto summary = got(splat_evaluator_summary, made);
    EXPECT_EQ(summary.objects, 2U);
    EXPECT_NEAR(summary.novel.psnr, (scores[0].novel.psnr + scores[1].novel.psnr) / 2, 1e-12);
    EXPECT_EQ(summary.ledger.gaussians, 2 * kScoredSide * kScoredSide);
    const json report = evaluation_json(made);
    EXPECT_EQ(report.at("novel").at("psnr"), summary.novel.psnr);
    EXPECT_EQ(report.at("split"), "train");
    EXPECT_TRUE(report.at("weights").is_null()) << "weights in memory";
    EXPECT_EQ(report.at("ledger").at("gaussians"), summary.ledger.gaussians);
    ASSERT_DONE(splat_evaluator_get_info(made, &info));
    EXPECT_EQ(info.scored, 2U);
}

TEST_F(ApiEvaluator, GivesTheViewsThatItScores) {
    const Evaluator made = evaluator(predictor_);
    const auto scores = got(splat_evaluator_score, made, 1);
    std::uint32_t numbers[3];
    splat_camera cameras[3];
    Floats images(3 * kScoredPlane), drawn(3 * kScoredPlane);
    auto views = got(splat_evaluator_read, made, 1);
    EXPECT_EQ(views.inputs, 1U);
    EXPECT_EQ(views.novel, 2U);
    views.numbers = numbers;
    views.number_count = 3;
    views.cameras = cameras;
    views.camera_count = 3;
    views.images = images.data();
    views.image_count = images.size();
    views.drawn = drawn.data();
    views.drawn_count = drawn.size();
    ASSERT_DONE(splat_evaluator_read(made, 1, &views));
    EXPECT_EQ(numbers[2], 2U);
    EXPECT_EQ(cameras[0].width, kScoredSide);
    EXPECT_EQ(cameras[0].world_to_camera[0], 1);
    double psnr = 0;
    for (std::size_t i = 1; i < 3; ++i) {
        const splat_image a = planes_image(drawn.data() + i * kScoredPlane, kScoredSide);
        const splat_image b = planes_image(images.data() + i * kScoredPlane, kScoredSide);
        const auto one = got(splat_image_compare, &a, &b);
        psnr += one.psnr / 2;
    }
    EXPECT_NEAR(scores.novel.psnr, psnr, 1e-9);
    EXPECT_REFUSED(splat_evaluator_read(made, 0, &views), kState, "latest");
}

TEST_F(ApiEvaluator, WeightsThatOverflowHaveNoScore) {
    const Predictor broken = flat_predictor(device_, 3.4e38F, 0);
    const Evaluator made = evaluator(broken);
    const auto scores = got(splat_evaluator_score, made, 0);
    EXPECT_EQ(scores.not_finite, 1U);
    EXPECT_GT(scores.ledger.outputs_not_finite, 0U);
    EXPECT_TRUE(std::isnan(scores.novel.psnr));
    EXPECT_TRUE(std::isnan(scores.novel.ssim));
    const json report = evaluation_json(made);
    EXPECT_TRUE(report.at("novel").at("psnr").is_null());
    EXPECT_EQ(report.at("ledger").at("objects").at(0).at("object"), scores.name);
    const auto summary = got(splat_evaluator_summary, made);
    EXPECT_EQ(summary.objects_not_finite, 1U);
    EXPECT_TRUE(std::isnan(summary.conditioning.psnr));
}

TEST_F(ApiEvaluator, CountsImagesInWhichNothingIsDrawn) {
    // Outputs of -20 give opacities of about 0.
    const Predictor faint = flat_predictor(device_, 0, -20);
    const Evaluator made = evaluator(faint);
    const auto scores = got(splat_evaluator_score, made, 0);
    EXPECT_EQ(scores.ledger.images_blank, 3U);
    EXPECT_EQ(scores.ledger.gaussians_invisible, kScoredSide * kScoredSide);
    EXPECT_EQ(scores.not_finite, 0U) << "the images can be scored";
    EXPECT_EQ(evaluation_json(made).at("ledger").at("objects").at(0).at("images_blank"), 3);
}

TEST_F(ApiEvaluator, ScoresImagesOfTheCallerWithoutADevice) {
    const Evaluator made = make_evaluator(dataset_);
    Floats images(3 * kScoredPlane);
    auto views = sized<splat_evaluated_views>();
    views.images = images.data();
    views.image_count = images.size();
    ASSERT_DONE(splat_evaluator_read(made, 0, &views));
    const auto scores = got(splat_evaluator_score_images, made, 0, images.data(), images.size());
    EXPECT_EQ(scores.novel.perfect_views, 2U);
    EXPECT_EQ(scores.novel.ssim, 1);
    EXPECT_EQ(evaluation_json(made).at("baseline"), "mine");
    EXPECT_REFUSED(splat_evaluator_score(made, 0, nullptr), kState, "'mine'");
}

TEST_F(ApiEvaluator, OutlivesItsParts) {
    const Evaluator made = evaluator(predictor_);
    auto before = sized<splat_object_scores>(), after = before;
    ASSERT_DONE(splat_evaluator_score(made, 0, &before));
    dataset_.destroy();
    predictor_.destroy();
    device_.destroy();
    ASSERT_DONE(splat_evaluator_score(made, 0, &after));
    EXPECT_EQ(before.novel.psnr, after.novel.psnr);
}

TEST_F(ApiEvaluator, SavesWhatCompareReads) {
    const Evaluator made = evaluator(predictor_);
    for (std::uint32_t i = 0; i < 2; ++i) ASSERT_DONE(splat_evaluator_score(made, i, nullptr));
    const Temporary folder;
    ASSERT_DONE(splat_evaluator_save(made, (folder / "a/b").c_str()));
    std::ifstream file(folder / "a/b/results.json");
    EXPECT_EQ(json::parse(file), evaluation_json(made));
    const std::string a = folder / "a/b";
    const std::string b = folder / "a/b/scores.txt";
    auto desc = sized<splat_compare_desc>();
    desc.a.path = a.c_str();
    desc.b.path = b.c_str();
    const Comparison comparison = got(splat_compare_scores, &desc);
    const auto info = got(splat_comparison_get_info, comparison);
    EXPECT_EQ(info.shared_objects, 2U);
    EXPECT_EQ(info.metrics, 2U) << "no LPIPS";
    desc.b.path = a.c_str();
    const auto metric = got(splat_comparison_metric, got(splat_compare_scores, &desc), 0);
    EXPECT_EQ(metric.ties, 2U);
    EXPECT_GT(metric.image_ties, 2U);
    EXPECT_EQ(metric.image_wins_a + metric.image_wins_b, 0U);
}

TEST_F(ApiEvaluator, MergesWhatOthersScored) {
    const Temporary folder;
    const std::string first = folder / "0", second = folder / "1", whole = folder / "whole";
    const Evaluator all = evaluator(predictor_), one = evaluator(predictor_),
                    other = evaluator(predictor_);
    for (std::uint32_t i = 0; i < 2; ++i) ASSERT_DONE(splat_evaluator_score(all, i, nullptr));
    ASSERT_DONE(splat_evaluator_save(all, whole.c_str()));
    ASSERT_DONE(splat_evaluator_score(one, 0, nullptr));
    ASSERT_DONE(splat_evaluator_save(one, first.c_str()));
    ASSERT_DONE(splat_evaluator_score(other, 1, nullptr));
    ASSERT_DONE(splat_evaluator_load(other, first.c_str()));
    // All but the times.
    json expected = evaluation_json(all), merged = evaluation_json(other);
    for (const char* rate : {"predictions_per_second", "images_per_second"}) {
        EXPECT_GT(merged.at(rate).get<double>(), 0);
        expected.erase(rate);
        merged.erase(rate);
    }
    EXPECT_EQ(merged, expected);
    ASSERT_DONE(splat_evaluator_save(other, second.c_str()));
    EXPECT_EQ(file_bytes(second + "/scores.txt"), file_bytes(whole + "/scores.txt"));

    // What is refused leaves the scores as they were.
    std::string text = file_bytes(first + "/objects.json");
    const auto refused = [&](const std::string& from, const std::string& to, splat_result code,
                             const char* part) {
        std::string changed = text;
        changed.replace(changed.find(from), from.size(), to);
        std::ofstream(first + "/objects.json") << changed;
        const json before = evaluation_json(other);
        EXPECT_REFUSED(splat_evaluator_load(other, first.c_str()), code, part);
        EXPECT_EQ(evaluation_json(other), before);
    };
    refused("\"network\": \"", "\"network\": \"x", kArgument, "scores of network 'x");
    refused("1 inputs, all novel", "1 inputs, 1 novel", kArgument,
            "scores of views '1 inputs, 1 novel', expected '1 inputs, all novel'");
    refused("\"object\": \"", "\"object\": \"x", kArgument, "is not among those to score");
    refused("\"views_novel\": ", "\"views_novel\": -", kFormat, "no number 'views_novel'");
    refused("\"drawn\": ", "\"drawn\": 99999999999", kFormat, "no number 'drawn'");
    refused("\"drawn\": ", "\"dawn\": ", kFormat, "no number 'drawn'");
    refused("}", "", kFormat, "objects.json");
    // Weights in memory have no name, but are others all the same.
    const Predictor flat = flat_predictor(device_, 0, 0);
    EXPECT_REFUSED(splat_evaluator_load(evaluator(flat), second.c_str()), kArgument,
                   "scores of network '");
}

TEST(ApiComparison, TellsEveryNumberOfAMetric) {
    const Comparison comparison = make_comparison();
    const auto info = got(splat_comparison_get_info, comparison);
    EXPECT_EQ(info.metrics, 3U);
    EXPECT_EQ(info.objects_a, 2U);
    EXPECT_EQ(info.comparable, 1U);
    auto metric = got(splat_comparison_metric, comparison, 0);
    EXPECT_EQ(metric.metric, SPLAT_METRIC_PSNR);
    EXPECT_EQ(metric.verdict, SPLAT_VERDICT_TOO_FEW);
    EXPECT_EQ(metric.exact, 1U);
    EXPECT_EQ(metric.mean_a, 21);
    EXPECT_EQ(metric.difference, 1.5);
    EXPECT_EQ(metric.p_permutation, 0.5);
    EXPECT_EQ(metric.p_holm, 1);
    EXPECT_EQ(metric.n_a, 2U);
    EXPECT_EQ(metric.bca_low, 1);
    EXPECT_EQ(metric.bca_high, 2);
    EXPECT_EQ(metric.p_wilcoxon, 0.5);
    EXPECT_EQ(metric.p_wilcoxon_holm, 1);
    EXPECT_EQ(metric.wilcoxon_w, 3);
    EXPECT_EQ(metric.wilcoxon_n, 2U);
    EXPECT_EQ(metric.wilcoxon_exact, 1U);
    EXPECT_EQ(metric.wilcoxon_tied, 0U);
    EXPECT_EQ(metric.wins_b, 2U);
    EXPECT_EQ(metric.wins_a + metric.ties + metric.image_wins_b, 0U);
    double a[2], b[2];
    ASSERT_DONE(splat_comparison_samples(comparison, 0, a, 2, b, 2));
    EXPECT_EQ(a[1], 22);
    EXPECT_EQ(b[1], 24);
    ASSERT_DONE(splat_comparison_metric(comparison, 2, &metric));
    EXPECT_EQ(metric.metric, SPLAT_METRIC_LPIPS);
    const json report = json::parse(text_of(splat_comparison_report, comparison));
    EXPECT_EQ(report.at("metrics").at(0).at("observed_difference"), 1.5);
    EXPECT_EQ(report.at("metrics").at(0).at("verdict"), "too few objects");
}

TEST(ApiComparison, UnpairedScoresOfOtherObjectsAreNotComparable) {
    static const splat_score others[] = {{"z", 30, 0.9, 0.1}, {"w", 31, 0.9, NAN}};
    splat_compare_desc desc = compare_desc();
    desc.flags = SPLAT_COMPARE_UNPAIRED;
    desc.b = {nullptr, others, 2};
    const Comparison comparison = got(splat_compare_scores, &desc);
    const auto info = got(splat_comparison_get_info, comparison);
    EXPECT_EQ(info.comparable, 0U);
    EXPECT_EQ(info.shared_objects, 0U);
    const auto metric = got(splat_comparison_metric, comparison, 2);
    EXPECT_EQ(metric.verdict, SPLAT_VERDICT_NOT_COMPARABLE);
    EXPECT_EQ(metric.n_b, 1U) << "NaN is no score";
    EXPECT_TRUE(std::isnan(metric.p_wilcoxon));
    EXPECT_EQ(metric.wins_a + metric.wins_b + metric.ties, 0U);
}

}  // namespace
}  // namespace splat::test

#include "eval/evaluation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "core/json.h"
#include "eval/json_number.h"
#include "eval/saved_objects.h"
#include "support/expect_status.h"

namespace splat::eval {
namespace {

std::string number_text(double value) {
    JsonWriter json;
    write_number(json, value);
    return json.text();
}

TEST(JsonNumber, IsTheShortestThatParsesToTheSame) {
    EXPECT_EQ(number_text(1), "1.0");
    EXPECT_EQ(number_text(0.00001), "1e-05");
    // The JSON library writes it this way, and files had it before.
    for (const double value : {0.0, -0.1, 0.0001, 0.000999, 1e5, 123456789.0, 9.9e14, 1e15, 1e20,
                               19.934567890123456, 1.0 / 3, 2.5e-300})
        EXPECT_EQ(number_text(value), Json(value).dump());
    EXPECT_EQ(number_text(std::nan("")), "null");
}

TEST(EvaluatedViews, FollowTheProtocolOfTheData) {
    const auto inputs = [](std::uint32_t count, std::uint32_t given, const char* format) {
        return evaluated_views(count, given, 0, format).value().conditioning;
    };
    using Numbers = std::vector<std::uint32_t>;
    EXPECT_EQ(inputs(251, 1, "srn"), Numbers{64});
    EXPECT_EQ(inputs(251, 2, "srn"), (Numbers{64, 128}));
    EXPECT_EQ(inputs(24, 2, "nmr"), (Numbers{0, 1}));
    EXPECT_EQ(inputs(100, 1, "co3d"), Numbers{0});
    EXPECT_EQ(inputs(100, 2, "co3d"), (Numbers{0, 30}));
    EXPECT_EQ(inputs(20, 2, "co3d"), (Numbers{0, 1}));
    EXPECT_EQ(inputs(251, 2, "co3d"), (Numbers{0, 30}));
    EXPECT_EQ(evaluated_views(251, 1, 0, "srn").value().novel.size(), 250U);
    const EvaluatedViews few = evaluated_views(9, 1, 4).value();
    EXPECT_EQ(few.novel, (Numbers{2, 4, 6, 8}));
    EXPECT_EQ(few.all(), (Numbers{0, 2, 4, 6, 8}));
    EXPECT_ERROR(evaluated_views(2, 2, 0), Code::kFormat, "more than 2");
}

TEST(EvaluatedViews, MayStartFromAView) {
    using Numbers = std::vector<std::uint32_t>;
    EXPECT_EQ(evaluated_views_from(2, 4, 1, 0).value().all(), (Numbers{2, 0, 1, 3}));
    EXPECT_EQ(evaluated_views_from(2, 4, 2, 0).value().conditioning, (Numbers{2, 0}));
    EXPECT_EQ(evaluated_views_from(0, 4, 3, 0).value().all(), (Numbers{0, 1, 2, 3}));
    EXPECT_ERROR(evaluated_views_from(4, 4, 1, 0), Code::kInvalidArgument, "does not exist");
    EXPECT_ERROR(evaluated_views_from(1, 2, 2, 0), Code::kFormat, "more than 2");
}

TEST(EvaluatedViews, MayBeGiven) {
    const std::uint32_t given[] = {3, 0}, twice[] = {1, 1}, missing[] = {5};
    const EvaluatedViews views = evaluated_views(5, given, 0).value();
    EXPECT_EQ(views.all(), (std::vector<std::uint32_t>{3, 0, 1, 2, 4}));
    EXPECT_ERROR(evaluated_views(5, twice, 0), Code::kInvalidArgument, "twice");
    EXPECT_ERROR(evaluated_views(5, missing, 0), Code::kInvalidArgument, "does not exist");
}

ObjectScores object(const char* name, double psnr) {
    ObjectScores made;
    made.name = name;
    made.novel.add({0.01, psnr, 0.5}, std::nan(""));
    made.novel.finish();
    made.conditioning.add({0, std::numeric_limits<double>::infinity(), 1}, std::nan(""));
    made.conditioning.finish();
    made.predict_seconds = 0.5;
    made.draw_seconds = 0.25;
    made.drawn = 2;
    return made;
}

TEST(Evaluation, TextsAreThoseOfFiles) {
    Evaluation all;
    all.weights = "w.safetensors";
    all.format = "srn";
    all.split = "test";
    all.data_objects = 3;
    all.device = "a device";
    all.objects[0] = object("a", 20);
    all.objects[1] = object("b", 30.5);
    all.objects[1].ledger.images_blank = 1;
    EXPECT_EQ(table_text(all),
              "object,psnr_novel,ssim_novel,lpips_novel,psnr_cond,ssim_cond,lpips_cond,views,"
              "perfect_views,predict_ms,draw_ms\n"
              "a,20,0.5,nan,nan,1,nan,2,1,500.000,250.000\n"
              "b,30.5,0.5,nan,nan,1,nan,2,1,500.000,250.000\n");
    EXPECT_EQ(scores_text(all), "0_a 20 0.5 nan\n1_b 30.5 0.5 nan\n");
    EXPECT_EQ(results_text(all), R"({
  "schema": 1,
  "weights": "w.safetensors",
  "baseline": null,
  "split": "test",
  "data": {
    "format": "srn",
    "objects": 3
  },
  "device": "a device",
  "objects": 2,
  "novel": {
    "psnr": 25.25,
    "ssim": 0.5,
    "lpips": null,
    "views": 2,
    "perfect_views": 0
  },
  "conditioning": {
    "psnr": null,
    "ssim": 1.0,
    "lpips": null,
    "views": 2,
    "perfect_views": 2
  },
  "empty_views": 0,
  "predictions_per_second": 2.0,
  "images_per_second": 8.0,
  "ledger": {
    "outputs_not_finite": 0,
    "gaussians": 0,
    "gaussians_not_finite": 0,
    "gaussians_invisible": 0,
    "gaussians_visible": 0,
    "images_not_finite": 0,
    "images_blank": 1,
    "objects": [
      {
        "object": "b",
        "outputs_not_finite": 0,
        "gaussians": 0,
        "gaussians_not_finite": 0,
        "gaussians_invisible": 0,
        "gaussians_visible": 0,
        "images_not_finite": 0,
        "images_blank": 1
      }
    ]
  }
})");
}

TEST(Evaluation, AnObjectThatIsNotFiniteLeavesNoMean) {
    Evaluation all;
    all.objects[0] = object("a", 20);
    all.objects[1] = object("b", std::nan(""));
    all.objects[1].ledger.outputs_not_finite = 7;
    const Summary summary = summary_of(all);
    EXPECT_TRUE(std::isnan(summary.novel.psnr));
    EXPECT_EQ(summary.objects_not_finite, 1U);
    EXPECT_HAS(results_text(all), "\"psnr\": null");
}

TEST(Evaluation, CountsOfImagesHave32Bits) {
    const std::string folder = testing::TempDir();
    Evaluation all;
    all.objects[0] = object("a", 20);
    const auto loaded = [&] {
        std::ofstream(folder + "/" + kObjectsFile) << objects_text(all);
        return load_objects(folder, all, [](const std::string&) { return std::optional(0U); });
    };
    for (const auto& [name, count] : {std::pair{"images_not_finite", &Ledger::images_not_finite},
                                      {"images_blank", &Ledger::images_blank}}) {
        std::uint64_t& images = all.objects[0].ledger.*count;
        images = 4294967295;
        EXPECT_EQ(need(loaded()).at(0).ledger.*count, 4294967295);
        images = 4294967296;
        EXPECT_ERROR(loaded(), Code::kFormat, name);
        images = 0;
    }
    all.objects[0].ledger.gaussians = 4294967296;
    EXPECT_OK(loaded());
}

TEST(Evaluation, AFolderThatCannotBeMadeIsAnError) {
    EXPECT_ERROR(save({}, "/dev/null/x"), Code::kIo, "cannot make the folder");
}

}  // namespace
}  // namespace splat::eval

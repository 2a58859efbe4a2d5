#include "eval/score_table.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "eval/csv_table.h"
#include "support/decimal_comma.h"
#include "support/expect_status.h"
#include "support/hostile_names.h"
#include "support/system.h"

namespace splat::eval {
namespace {

class ScoreTableTest : public testing::Test {
  protected:
    void SetUp() override { std::filesystem::create_directories(folder_); }
    void TearDown() override { std::filesystem::remove_all(folder_); }

    Result<ScoreTable> read_text(const char* name, const std::string& text) {
        std::ofstream(folder_ / name, std::ios::binary) << text;
        return read_scores((folder_ / name).string());
    }
    ScoreTable read(const char* name, const std::string& text) {
        return need(read_text(name, text));
    }
    void refused(const std::string& text, const char* part) {
        EXPECT_ERROR(read_text("bad.csv", text), Code::kFormat, part);
    }

    std::filesystem::path folder_ =
        std::filesystem::temp_directory_path() / ("splat-scores-" + test::process_text());
};

TEST_F(ScoreTableTest, ReadsBothFormats) {
    const ScoreTable text = read("scores.txt", "0_b 20.5 0.9 nan\n1_a_1 inf 0.8 0.1\n");
    EXPECT_EQ(text.objects.size(), 2U);
    EXPECT_EQ(text.values.at("psnr"), (std::map<std::string, double>{{"b", 20.5}}));
    EXPECT_EQ(text.values.at("ssim"), (std::map<std::string, double>{{"a_1", 0.8}, {"b", 0.9}}));
    EXPECT_EQ(text.values.at("lpips"), (std::map<std::string, double>{{"a_1", 0.1}}));
    const ScoreTable table =
        read("per_object.csv", "object,psnr_novel,ssim_novel,psnr_cond\n0_b,20.5,0.9,33\n");
    EXPECT_EQ(table.metrics, (std::vector<std::string>{"psnr", "ssim"}));
    EXPECT_EQ(table.values.at("ssim"), (std::map<std::string, double>{{"0_b", 0.9}}));
    for (const std::string& path : {folder_.string(), (folder_ / "results.json").string()})
        EXPECT_EQ(read_scores(path).value().values, table.values);
}

/// Numbers of views are those of the column, which views they are tells objects.json.
TEST_F(ScoreTableTest, ViewsAreThoseOfTheFolder) {
    const ScoreTable alone = read("per_object.csv", "object,psnr_novel,views\na,20,251\nb,21,\n");
    EXPECT_EQ(alone.views, (std::map<std::string, double>{{"a", 251}}));
    EXPECT_EQ(alone.protocol, "");
    std::ofstream(folder_ / "objects.json") << R"({"views": "1 inputs, all novel, LPIPS"})";
    EXPECT_EQ(read_scores(folder_.string()).value().protocol, "1 inputs, all novel");
    EXPECT_TRUE(alone.images.empty());
    const std::string images = "object,view,psnr_novel,ssim_novel,lpips_novel\na,3,20,0.5,nan\n";
    std::ofstream(folder_ / "per_image.csv") << images;
    EXPECT_EQ(read_scores(folder_.string()).value().images.at("a")[0].view, 3U);
    EXPECT_ERROR(read_scores((folder_ / "per_image.csv").string()), Code::kFormat,
                 "of one object are not independent; expected the per_object.csv");
    std::ofstream(folder_ / "per_image.csv") << images + "a,3,20,0.5,nan\n";
    EXPECT_ERROR(read_scores(folder_.string()), Code::kFormat, "per_image.csv', line 3: view 3 of");
    std::filesystem::remove(folder_ / "per_image.csv");
    std::ofstream(folder_ / "objects.json") << "{";
    EXPECT_EQ(read_scores(folder_.string()).value().protocol, "") << "damaged: not told";
}

/// Names from data sets, in both files as they are written.
TEST_F(ScoreTableTest, AnyNameComesBack) {
    std::vector<std::string> names = test::hostile_names();
    for (const char* name : {"sedan,35", "say \"hello\"", "%41", "", "a,b\n\"c", "3_4"})
        names.emplace_back(name);
    std::string csv = "object,psnr_novel,ssim_novel\r\n";
    std::string text;
    for (std::size_t i = 0; i < names.size(); ++i) {
        if (!names[i].empty()) csv += csv_field(names[i]) + format(",%zu.5,0.9\r\n", i);
        text += format("%zu_%s %zu.5 0.9 0.1\n", i, scores_name(names[i]).c_str(), i);
    }
    const ScoreTable table = read("per_object.csv", csv);
    const ScoreTable scores = read("scores.txt", text);
    EXPECT_EQ(table.objects.size(), names.size() - 1);
    EXPECT_EQ(scores.objects.size(), names.size());
    for (std::size_t i = 0; i < names.size(); ++i) {
        const double expected = static_cast<double>(i) + 0.5;
        if (!names[i].empty()) {
            ASSERT_TRUE(table.values.at("psnr").contains(names[i])) << names[i];
            EXPECT_EQ(table.values.at("psnr").at(names[i]), expected) << names[i];
        }
        ASSERT_TRUE(scores.values.at("psnr").contains(names[i])) << names[i];
        EXPECT_EQ(scores.values.at("psnr").at(names[i]), expected) << names[i];
    }
}

TEST_F(ScoreTableTest, ReadsWhatPandasWrites) {
    const ScoreTable table =
        read("per_object.csv",
             "object,psnr_novel,ssim_novel,lpips_novel\n\"a \"\"b\"\"\",20,0.9,\nc,21,,\n");
    EXPECT_EQ(table.metrics, (std::vector<std::string>{"psnr", "ssim"})) << "empty is no score";
    EXPECT_EQ(table.values.at("psnr").at("a \"b\""), 20);
    EXPECT_EQ(table.values.at("ssim").size(), 1U);
}

/// Files of earlier versions, with names that were written as they are.
TEST_F(ScoreTableTest, RefusesShiftedColumns) {
    refused("object,psnr_novel,ssim_novel\nsedan,35,22.8,0.9\n",
            "line 2: 4 columns, expected 3, as in the heading");
    refused("0_two words 22.8 0.9 0.1\n", "line 1: 5 columns, expected 4");
    EXPECT_EQ(read("scores.txt", "0_sedan,35 22.8 0.9 0.1\n").values.at("psnr").at("sedan,35"),
              22.8);
    refused("object,psnr_novel\n\"a,1\n", "line 2: a quoted field has no end");
    refused("object,psnr_novel\n\"a\"b,1\n", "line 2: a quoted field goes on behind its quote");
}

TEST_F(ScoreTableTest, ReadsDecimalPointsInAnyLocale) {
    const test::DecimalComma comma;
    if (!comma) GTEST_SKIP() << "no locale with decimal commas: install locales";
    EXPECT_EQ(read("scores.txt", "0_b 20.5 0.9 0.1\n").values.at("psnr").at("b"), 20.5);
}

TEST_F(ScoreTableTest, SaysWhatIsWrong) {
    refused("", "holds no scores");
    refused("object,psnr_novel\n", "holds no scores");
    refused("name,psnr_novel\na,1\n", "line 1: expected a heading");
    refused("object,psnr_novel\na,1\na,2\n", "line 3: object 'a' is in line 2 already");
    refused("object,psnr_novel\na,x\n", "line 2: 'x' is not a number");
    for (const char* text : {"0x1p3", "1e999", "-1e999", "1.5x", "nan(0x1)"})
        refused("0_a " + std::string(text) + " 0.9 0.1\n", "' is not a number");
    refused(std::string("object,psnr_novel\na,0.1") + '\0' + "garbage\n",
            "line 2: '0.1?garbage' is not a number");
    refused("object,psnr_novel\na," + std::string(5000, '7') + "x\n", "777...' is not a number");
    refused("object,psnr_novel\na\n", "line 2: 1 columns, expected 2");
    refused("0_a 1 2\n", "line 1: 3 columns, expected 4");
    EXPECT_FALSE(read_scores("/nonexistent").ok());
}

}  // namespace
}  // namespace splat::eval

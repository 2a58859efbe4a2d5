#include "eval/image_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "support/expect_status.h"
#include "support/system.h"

namespace splat::eval {
namespace {

class ImageTableTest : public testing::Test {
  protected:
    void SetUp() override { std::filesystem::create_directories(folder_); }
    void TearDown() override { std::filesystem::remove_all(folder_); }

    Result<ImageTable> read(const std::string& text) {
        std::ofstream(folder_ / kImagesFile, std::ios::binary) << text;
        return read_image_scores(folder_.string());
    }
    void refused(const std::string& lines, const char* part) {
        EXPECT_ERROR(read("object,view,psnr_novel,ssim_novel,lpips_novel\n" + lines), Code::kFormat,
                     part);
    }

    std::filesystem::path folder_ =
        std::filesystem::temp_directory_path() / ("splat-images-" + test::process_text());
};

TEST_F(ImageTableTest, ReadsWhatItWrites) {
    EXPECT_TRUE(need(read_image_scores(folder_.string())).empty()) << "of an earlier version";
    const ImageTable images = {{"a, \"b\"", {{3, 20.5, 0.75, NAN}, {7, INFINITY, 1, 0}}},
                               {"c", {{0, NAN, NAN, NAN}}}};
    const std::string text = image_table_text(images);
    EXPECT_EQ(text,
              "object,view,psnr_novel,ssim_novel,lpips_novel\n\"a, \"\"b\"\"\",3,20.5,0.75,nan\n"
              "\"a, \"\"b\"\"\",7,inf,1,0\nc,0,nan,nan,nan\n");
    const ImageTable found = need(read(text));
    ASSERT_EQ(found.size(), 2U);
    const ViewScores& perfect = found.at("a, \"b\"")[1];
    EXPECT_EQ(perfect.view, 7U);
    EXPECT_EQ(perfect.psnr, INFINITY);
    EXPECT_EQ(image_table_text(found), text);
}

TEST_F(ImageTableTest, DamageIsNamedByItsLine) {
    EXPECT_ERROR(read("object,psnr_novel\n"), Code::kFormat, "line 1: expected the heading");
    EXPECT_ERROR(read(""), Code::kFormat, "line 1: expected the heading");
    refused("a,0,1,2\n", "line 2: 4 columns, expected 5");
    refused("a,0,1,2,x\n", "line 2: 'x' is not a number");
    for (const char* view : {"-1", "0.5", "4294967296", "nan", ""})
        refused(std::string("a,") + view + ",1,2,3\n", "is not a number of a view");
    refused("a,0,1,2,3\nb,0,1,2,3\na,0,1,2,3\n", "line 4: view 0 of object 'a' is in the table");
}

}  // namespace
}  // namespace splat::eval

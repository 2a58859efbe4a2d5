#include "data/dataset_check.h"

#include <gtest/gtest.h>

#include "support/expect_status.h"
#include "synthetic/sample_folder.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;
using namespace test;

/// The library of mingw copies over no file.
void replace_by_copy(const fs::path& from, const fs::path& to) {
    fs::remove(to);
    fs::copy_file(from, to);
}

class DatasetCheck : public testing::Test {
  protected:
    void SetUp() override { write_all(sample_cars(folder_.path())); }

    /// The findings on object 0 of the training split.
    ObjectCheck check(bool lenient = true) {
        DatasetDesc desc;
        desc.path = folder_.path().string();
        desc.lenient = lenient;
        const auto dataset = need(Dataset::open(desc));
        return need(check_object(*dataset, 0));
    }

    /// Exactly one problem and one warning that contain the parts; no finding where the part is
    /// null.
    void expect(const char* problem, const char* warning) {
        const ObjectCheck found = check();
        ASSERT_EQ(found.problems.size(), problem == nullptr ? 0U : 1U)
            << (found.problems.empty() ? "" : found.problems.back());
        ASSERT_EQ(found.warnings.size(), warning == nullptr ? 0U : 1U)
            << (found.warnings.empty() ? "" : found.warnings.back());
        if (problem != nullptr) {
            EXPECT_HAS(found.problems[0], problem);
        }
        if (warning != nullptr) {
            EXPECT_HAS(found.warnings[0], warning);
        }
    }

    SampleFolder folder_;
    fs::path object_ = folder_ / "srn_cars/cars_train/000000_car";
};

TEST_F(DatasetCheck, FindsNothingInGoodData) {
    expect(nullptr, nullptr);
    const ObjectCheck found = check();
    EXPECT_EQ(found.width, 16U);
    EXPECT_EQ(found.hash, check(false).hash);
}

TEST_F(DatasetCheck, HashIsThatOfTheContents) {
    const std::uint64_t before = check().hash;
    const std::string pose = file_text(object_ / "pose/000001.txt");
    put_text(object_ / "pose/000001.txt", pose + "  \n");
    EXPECT_EQ(check().hash, before) << "blanks change nothing";
    put_text(object_ / "pose/000001.txt", file_text(object_ / "pose/000000.txt"));
    EXPECT_NE(check().hash, before);
    put_text(object_ / "pose/000001.txt", pose);
    EXPECT_EQ(check().hash, before);
    put_image(object_ / "mask/000001.png", 16, 1);
    EXPECT_NE(check().hash, before);
}

TEST_F(DatasetCheck, FindsMissingFiles) {
    fs::remove(object_ / "rgb/000001.png");
    fs::remove(object_ / "depth/000001.png");
    fs::remove(object_ / "normal/000001.png");
    fs::remove(object_ / "mask/000001.png");
    expect("poses without image: 1 (first '000001')", nullptr);
}

TEST_F(DatasetCheck, FindsMissingMaps) {
    fs::remove(object_ / "depth/000001.png");
    const ObjectCheck found = check();
    ASSERT_EQ(found.problems.size(), 2U);
    EXPECT_HAS(found.problems[0], "3 poses and 2 images in depth");
    EXPECT_HAS(found.problems[1], "depth' has no map '000001'");
}

TEST_F(DatasetCheck, FindsDamagedImages) {
    put_text(object_ / "normal/000002.png", "no image");
    expect("normal/000002.png': not a PNG", nullptr);
}

TEST_F(DatasetCheck, FindsInvalidPoses) {
    put_text(object_ / "pose/000001.txt", "inf 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1");
    expect("the matrix is not finite", nullptr);
}

TEST_F(DatasetCheck, FindsOtherSizes) {
    put_image(object_ / "rgb/000002.png", 8, 3);
    expect("view 2: rgb has 8 x 8 pixels, the first image 16 x 16", nullptr);
}

/// The pixels of an image of another size are not decoded: these are cut off.
TEST_F(DatasetCheck, ComparesSizesBeforePixels) {
    put_image(object_ / "rgb/000002.png", 32, 3);
    const std::string whole = file_text(object_ / "rgb/000002.png");
    put_text(object_ / "rgb/000002.png", whole.substr(0, 60));
    expect("view 2: rgb has 32 x 32 pixels, the first image 16 x 16", nullptr);
}

TEST_F(DatasetCheck, FindsAnObjectOfOneView) {
    for (const char* kind : {"rgb", "depth", "normal", "mask"})
        for (const char* name : {"000001.png", "000002.png"}) fs::remove(object_ / kind / name);
    fs::remove(object_ / "pose/000001.txt");
    fs::remove(object_ / "pose/000002.txt");
    expect("1 views, expected 2 or more", nullptr);
}

TEST_F(DatasetCheck, WarnsOfDuplicateViews) {
    replace_by_copy(object_ / "rgb/000000.png", object_ / "rgb/000002.png");
    expect(nullptr, "1 of 3 images are duplicates");
}

TEST_F(DatasetCheck, WarnsOfDuplicatePoses) {
    replace_by_copy(object_ / "pose/000000.txt", object_ / "pose/000002.txt");
    expect(nullptr, "views 0 and 2 have the same pose");
}

TEST_F(DatasetCheck, WarnsOfBlankImages) {
    put_png(object_ / "rgb/000001.png", {16, 16, 1, 8, std::vector<std::uint16_t>(256, 255)});
    expect(nullptr, "view 1 is of one colour (255)");
}

TEST_F(DatasetCheck, ListsTenAndCountsTheRest) {
    test::SampleFolder other;
    synthetic::WriterDesc desc = sample_cars(other.path());
    desc.train_views = 25;
    ASSERT_OK(synthetic::write_object(desc, 0));
    const fs::path poses = other / "srn_cars/cars_train/000000_car/pose";
    for (int view = 1; view < 25; ++view)
        replace_by_copy(poses / "000000.txt", poses / format("%06d.txt", view));
    DatasetDesc opened;
    opened.path = other.path().string();
    const auto dataset = need(Dataset::open(opened));
    const auto found = need(check_object(*dataset, 0));
    ASSERT_EQ(found.warnings.size(), 11U);
    EXPECT_EQ(found.warnings.back(), "and 14 more warnings");
    EXPECT_ERROR(check_object(*dataset, 1), Code::kInvalidArgument, "object is 1");
    EXPECT_EQ(check_text(*dataset, 0).value().find("{\"name\": \"000000_car\", \"views\": 25, "),
              0U);
}

}  // namespace
}  // namespace splat::data

// Masks of classes and instances as tokens: COCO's panoptic annotations and palettes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "data/panoptic/mask_tokens.h"
#include "data/sample_formats.h"
#include "data/view_vectors.h"
#include "io/file.h"
#include "io/weights_file.h"
#include "support/expect_status.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;
using namespace test;

/// A mask of 4 x 2 pixels with these colours.
io::Image mask_of(const std::vector<MaskId>& ids, std::uint32_t width = 4) {
    io::Image mask{width, static_cast<std::uint32_t>(ids.size()) / width, 3, 8, {}};
    for (const MaskId id : ids)
        for (const MaskId level : {id & 255U, id >> 8U & 255U, id >> 16U})
            mask.samples.push_back(static_cast<std::uint16_t>(level));
    return mask;
}

/// One picture of 4 x 2 pixels, "a/0.png", with these segments.
std::string coco(const std::string& segments, const std::string& size = R"("width":4,"height":2)") {
    return R"({"info":{},"images":[{"id":5,)" + size +
           R"(}],"annotations":[{"image_id":5,"file_name":"a/0.png","segments_info":[)" + segments +
           R"(]}],"categories":[{"id":3,"name":"car","isthing":1},{"id":200,"name":"sky"}]})";
}

const char* const kTwoCars =
    R"({"id":1,"category_id":3},{"id":66051,"category_id":200},{"id":7,"category_id":3,"area":9})";

std::vector<Segment> segments_of(const MaskNames& names, const std::vector<MaskId>& ids) {
    return need(names.segments(mask_of(ids), "a/0.png"));
}

/// 66051 is R 3, G 2, B 1.
TEST(MaskNames, SegmentsOfCocoAreOrderedByAreaAndNumber) {
    const MaskNames names = need(MaskNames::of_coco(coco(kTwoCars)));
    const auto found = segments_of(names, {66051, 66051, 0, 7, 66051, 7, 1, 1});
    ASSERT_EQ(found.size(), 3U);
    EXPECT_EQ(found[0].id, 66051U);
    EXPECT_EQ(found[0].name, "sky");
    EXPECT_EQ(found[0].area, 3U);
    EXPECT_EQ(found[1].id, 1U) << "of two that are equally large the first by its number";
    EXPECT_EQ(found[2].id, 7U);
    EXPECT_EQ(found[2].left, 1U) << "a lower row may begin further left";
    EXPECT_EQ(found[2].width, 3U);
    EXPECT_EQ(found[2].top, 0U);
    EXPECT_EQ(found[2].height, 2U);
}

TEST(MaskNames, AnAnnotationIsFoundByTheLastPartOfThePath) {
    std::string text = coco(kTwoCars);
    text.replace(text.find("a/0.png"), 7, "0.png");
    const MaskNames names = need(MaskNames::of_coco(text));
    EXPECT_EQ(segments_of(names, {66051, 66051, 0, 7, 66051, 7, 1, 1}).size(), 3U);
    EXPECT_ERROR(names.segments(mask_of({1, 1, 1, 1}), "a/1.png").status(), Code::kFormat,
                 "no annotation has the file_name 'a/1.png'");
}

TEST(MaskNames, MasksThatDoNotMatchAreNamed) {
    const MaskNames names = need(MaskNames::of_coco(coco(kTwoCars)));
    const auto status = [&](const io::Image& mask) {
        return names.segments(mask, "a/0.png").status();
    };
    EXPECT_ERROR(status(mask_of({1, 7, 66051, 0, 0, 0, 8, 0})), Code::kFormat,
                 "pixel (2, 1) has the id 8, which is not among the 3 of segments_info");
    EXPECT_ERROR(status(mask_of({1, 7, 0, 0, 0, 0, 0, 0})), Code::kFormat,
                 "segment 66051 of segments_info ('sky') has no pixel");
    EXPECT_ERROR(status(mask_of({1, 7, 66051, 0})), Code::kFormat,
                 "4 x 1 pixels, but the annotation's image has 4 x 2");
    EXPECT_ERROR(status({4, 2, 1, 8, std::vector<std::uint16_t>(8)}), Code::kFormat,
                 "1 channels of 8 bits, expected RGB");
}

TEST(MaskNames, DamagedAnnotationsAreNamed) {
    const auto status = [](const std::string& text) { return MaskNames::of_coco(text).status(); };
    EXPECT_ERROR(status("{\"images\": ["), Code::kFormat, "annotations");
    EXPECT_ERROR(status("[]"), Code::kFormat, "'categories' is missing");
    EXPECT_ERROR(status(coco(R"({"id":1,"category_id":4})")), Code::kFormat,
                 "segments_info[0]: 'categories' have no name for the category_id 4");
    EXPECT_ERROR(status(coco(R"({"id":0,"category_id":3})")), Code::kFormat, "the id is 0");
    EXPECT_ERROR(status(coco(R"({"id":16777216,"category_id":3})")), Code::kFormat,
                 "'id' is missing or no whole number of at most 16777215");
    EXPECT_ERROR(status(coco(R"({"id":1,"category_id":3},{"id":1,"category_id":3})")),
                 Code::kFormat, "segments_info[1]: the id 1 occurs twice");
    EXPECT_ERROR(status(coco("", R"("width":4)")), Code::kFormat, "images[0]: 'height'");
    std::string text = coco("");
    text.replace(text.find("\"image_id\":5"), 12, "\"image_id\":6");
    EXPECT_ERROR(status(text), Code::kFormat, "annotations[0]: 'images' have no id 6");
    text = coco("");
    text.replace(text.find("\"sky\""), 5, "\"\"");
    EXPECT_ERROR(status(text), Code::kFormat, "categories[1]: 'name' is missing");
}

TEST(MaskNames, ColoursOfAPaletteShareNames) {
    const MaskNames names = need(MaskNames::of_palette(
        "GIMP Palette\nName: x\nColumns: 4\n# of cars\r\n  0 0 0 void\n255\t0 0\tred car \r\n1 0 0 "
        "red car\n"));
    const auto found = segments_of(names, {0, 255, 1, 1, 0, 0, 0, 0});
    ASSERT_EQ(found.size(), 2U);
    EXPECT_EQ(found[0].id, 1U);
    EXPECT_EQ(found[1].name, "red car");
    EXPECT_ERROR(
        names.segments(mask_of({0, 0, 0, 254}), "x").status(), Code::kFormat,
        "pixel (3, 0) has the colour (254, 0, 0), which is not among the 3 of the palette");
    const io::Image gray{2, 1, 1, 8, {0, 0}};
    EXPECT_TRUE(need(names.segments(gray, "x")).empty());
}

TEST(MaskNames, DamagedPalettesAreNamed) {
    const auto status = [](const char* text) { return MaskNames::of_palette(text).status(); };
    EXPECT_ERROR(status("# none\n"), Code::kFormat, "no line 'R G B name'");
    EXPECT_ERROR(status("0 0 0 a\n0 256 0 b"), Code::kFormat, "line 2 is '0 256 0 b'");
    EXPECT_ERROR(status("0 0 0"), Code::kFormat, "line 1: the colour (0, 0, 0) has no name");
    EXPECT_ERROR(status("1 2 3 a\n\n1 2 3 b"), Code::kFormat,
                 "line 3: the colour (1, 2, 3) occurs twice");
}

TEST(MaskTokens, ATokenSaysClassInstanceBoxAndArea) {
    const Segment segment{7, "car", 3, 1, 0, 2, 2};
    const std::vector<float> token = token_of(segment, 2, 4, 8, 16);
    ASSERT_EQ(token.size(), 16U);
    for (std::size_t i = 0; i < 8; i += 2)
        EXPECT_NEAR(std::hypot(token[i], token[i + 1]), 1, 1e-6) << "sine and cosine of an angle";
    EXPECT_EQ(std::vector(token.begin() + 8, token.end()),
              (std::vector<float>{std::sin(2.0F), std::cos(2.0F), 0.5F, 0.125F, 0.5F, 0.25F,
                                  3.0F / 32, 1}));
    const Segment other{7, "cat", 3, 1, 0, 2, 2};
    const std::vector<float> of_other = token_of(other, 2, 4, 8, 16);
    EXPECT_FALSE(std::equal(token.begin(), token.begin() + 8, of_other.begin()));
    const std::vector<float> longer = token_of(segment, 2, 4, 8, 24);
    EXPECT_TRUE(std::equal(token.begin(), token.begin() + 8, longer.begin()));
}

TEST(MaskTokens, TheCodeOfANameStays) {
    const std::vector<float> token = token_of({1, "car", 1, 0, 0, 1, 1}, 0, 1, 1, 12);
    EXPECT_NEAR(token[0], -0.4591861, 1e-6);
    EXPECT_NEAR(token[1], 0.8883401, 1e-6);
}

TEST(MaskTokens, InstancesAreCountedInTheirClassAndViewsPadded) {
    const std::vector<Segment> segments = {
        {9, "car", 4, 0, 0, 2, 2}, {5, "sky", 2, 2, 0, 1, 2}, {7, "car", 1, 3, 0, 1, 1}};
    MaskTokensDesc desc;
    desc.dimension = 12;
    desc.tokens = 4;
    const std::vector<float> made = tokens_of(segments, 4, 2, desc);
    ASSERT_EQ(made.size(), 48U);
    const auto of = [&](std::size_t d, std::size_t token) { return made[d * 4 + token]; };
    EXPECT_EQ(of(4, 0), 0);
    EXPECT_EQ(of(4, 1), 0) << "the first of its class";
    EXPECT_EQ(of(4, 2), std::sin(1.0F)) << "the second car";
    for (std::size_t d = 0; d < 12; ++d) EXPECT_EQ(of(d, 3), 0) << "a token that is not there";
    desc.pooled = true;
    const std::vector<float> pooled = tokens_of(segments, 4, 2, desc);
    ASSERT_EQ(pooled.size(), 12U);
    EXPECT_FLOAT_EQ(pooled[11], 7.0F / 8) << "the share of the picture that segments cover";
    EXPECT_FLOAT_EQ(pooled[0], (5 * of(0, 0) + 2 * of(0, 1)) / 8);
}

class MaskTokensFile : public testing::Test {
  protected:
    MaskTokensFile() : folder_(testing::TempDir() + "/mask_tokens") {
        fs::remove_all(folder_);
        put_object(folder_ / "data/srn_cars/cars_train/b");
        put_object(folder_ / "data/srn_cars/cars_val/b");
        for (const char* split : {"train", "val"})
            for (const char* view : {"000000.png", "000001.png"})
                put_image(folder_ / "masks" / split / "b" / view, 8, 3, 0);
        write("palette.gpl", need(palette(folder_ / "masks/train/b/000000.png")));
        desc_.data = (folder_ / "data").string();
        desc_.masks = (folder_ / "masks").string();
        desc_.names = (folder_ / "palette.gpl").string();
        desc_.out = (folder_ / "tokens.npz").string();
        desc_.dimension = 12;
        desc_.tokens = 4;
    }
    ~MaskTokensFile() override { fs::remove_all(folder_); }

    /// A palette of all colours of an image.
    static Result<std::string> palette(const fs::path& path) {
        SPLAT_ASSIGN(const io::Buffer file, io::read_file(path.string()));
        SPLAT_ASSIGN(const io::Image image, io::read_png(file));
        std::set<std::string> lines;
        for (std::size_t i = 0; i < image.samples.size(); i += 3)
            lines.insert(format("%u %u %u class %u\n", image.samples[i], image.samples[i + 1],
                                image.samples[i + 2], image.samples[i] / 4U % 2U));
        std::string all;
        for (const std::string& line : lines) all += line;
        return all;
    }

    void write(const std::string& name, const std::string& text) const {
        EXPECT_OK(io::write_file((folder_ / name).string(), io::as_bytes(text)));
    }

    const fs::path folder_;
    MaskTokensDesc desc_;
};

TEST_F(MaskTokensFile, IsWhatTrainingsRead) {
    const MaskTokens made = need(write_mask_tokens(desc_));
    EXPECT_EQ(made.objects, 2U);
    EXPECT_EQ(made.views, 4U);
    EXPECT_EQ(made.classes, 2U);
    EXPECT_EQ(made.dropped, made.segments - 4 * 4) << "more than 4 colours of each view";
    const auto dataset = open_data(folder_ / "data", "val");
    const auto vectors =
        need(ViewVectors::load(desc_.out, {12, 4}, dataset->index(), "data.tokens_file"));
    std::vector<float> row;
    const std::uint32_t views[] = {1};
    vectors.append(0, views, row);
    EXPECT_EQ(row.size(), 48U);
    desc_.pooled = true;
    EXPECT_OK(write_mask_tokens(desc_).status());
    EXPECT_OK(ViewVectors::load(desc_.out, {12}, dataset->index(), "data.embedding_file").status());
}

TEST_F(MaskTokensFile, WhatDoesNotFitIsNamedAndNothingIsWritten) {
    const auto refused = [&](Code code, const char* part) {
        EXPECT_ERROR(write_mask_tokens(desc_).status(), code, part);
        EXPECT_FALSE(fs::exists(desc_.out));
    };
    put_image(folder_ / "masks/val/b/000001.png", 4, 3, 0);
    refused(Code::kFormat, "4 x 4 pixels, expected 8 x 8 as the picture of view 1");
    fs::remove(folder_ / "masks/val/b/000001.png");
    refused(Code::kFormat, "has 1 masks, expected one for each of the 2 views");
    fs::remove(folder_ / "masks/val/b/000000.png");
    refused(Code::kNotFound,
            "has no masks (.png), expected one for each of the 2 views of object 'val/b'");
    write("masks/val/b/000000.png", "no picture");
    write("masks/val/b/000001.png", "no picture");
    refused(Code::kFormat, "000000.png");
    desc_.names = (folder_ / "none.gpl").string();
    refused(Code::kNotFound, "none.gpl");
    desc_.dimension = 13;
    refused(Code::kInvalidArgument, "dimension is 13, expected an even number from 12 to 4096");
}

}  // namespace
}  // namespace splat::data

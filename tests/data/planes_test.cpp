// Maps of planes: what a network sees of them, and how data sets read them.
#include "data/planes/plane_channels.h"

#include <gtest/gtest.h>

#include "data/dataset_check.h"
#include "data/dataset_export.h"
#include "data/sample_formats.h"
#include "support/expect_status.h"
#include "support/log_capture.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;
using namespace test;

/// The pixels of a map, each of the numbers (k, 2 k, 3 k, k); 0: no plane.
std::vector<std::uint8_t> map_of_pixels(const std::vector<int>& pixels) {
    std::vector<std::uint8_t> map;
    for (const int k : pixels)
        for (const int factor : {1, 2, 3, 1}) map.push_back(static_cast<std::uint8_t>(factor * k));
    return map;
}

std::vector<float> channels_of_map(const std::vector<std::uint8_t>& map) {
    std::vector<float> channels(map.size() / 4 * kPlaneChannels, -1);
    plane_channels(map, channels);
    return channels;
}

std::vector<float> ids_of(const std::vector<int>& pixels) {
    const std::vector<float> channels = channels_of_map(map_of_pixels(pixels));
    return {channels.end() - static_cast<std::ptrdiff_t>(pixels.size()), channels.end()};
}

TEST(PlaneChannels, IdsAreThoseOfTheLargestFirst) {
    constexpr float kThird = 1.0F / 3, kTwo = 2.0F / 3;
    EXPECT_EQ(ids_of({9, 0, 5, 5, 7, 5, 7, 0, 0}),
              (std::vector<float>{1, 0, kThird, kThird, kTwo, kThird, kTwo, 0, 0}));
    EXPECT_EQ(ids_of({7, 3, 3, 7}), (std::vector<float>{0.5F, 1, 1, 0.5F}))
        << "of two as large, that of the first pixel is first";
    EXPECT_EQ(ids_of({3, 7, 7, 3}), (std::vector<float>{0.5F, 1, 1, 0.5F}));
    EXPECT_EQ(ids_of({0, 0, 0, 0}), std::vector<float>(4, 0));
    EXPECT_EQ(ids_of({0, 80, 0, 0}), (std::vector<float>{0, 1, 0, 0}));
}

TEST(PlaneChannels, NumbersOfAPixelWithoutDistanceCountAsNone) {
    std::vector<std::uint8_t> map = map_of_pixels({50, 60, 60, 50});
    map[3] = 0;
    const std::vector<float> channels = channels_of_map(map);
    for (std::size_t c = 0; c < 5; ++c) EXPECT_EQ(channels[4 * c], 0) << c;
    const float expected[] = {60, 120, 180, 60, 127.5F};
    for (std::size_t c = 0; c < 5; ++c) {
        EXPECT_EQ(channels[4 * c + 1], expected[c] / 255) << c;
        EXPECT_EQ(channels[4 * c + 2], channels[4 * c + 1]) << c;
    }
}

/// Two views of 8 x 8 pixels: rows of planes 10, 20, ... 80, which the second view has upside down.
class PlaneMaps : public testing::Test {
  protected:
    void SetUp() override {
        put_object(object_);
        for (std::size_t view = 0; view < 2; ++view) {
            std::vector<int> pixels;
            for (int i = 0; i < 64; ++i) pixels.push_back(10 * (view == 0 ? i / 8 + 1 : 8 - i / 8));
            const std::vector<std::uint8_t> map = map_of_pixels(pixels);
            put_png(object_ / "plane" / (view == 0 ? "000000.png" : "000001.png"),
                    {8, 8, 4, 8, {map.begin(), map.end()}});
        }
    }
    std::vector<float> read(std::uint32_t resolution) {
        DatasetDesc desc = data_desc(folder_.path());
        desc.maps = flag_of(MapKind::kPlane);
        desc.resolution = resolution;
        desc.background = {1, 1, 1};
        std::vector<float> planes(2 * std::size_t{5} * resolution * resolution);
        const std::uint32_t views[] = {0, 1};
        const auto dataset = open_data(desc);
        EXPECT_OK(dataset->read(0, views, {.planes = planes.data()}));
        return planes;
    }

    SampleFolder folder_;
    fs::path object_ = folder_ / "a_train/o";
};

TEST_F(PlaneMaps, AreThoseOfTheNearestPixels) {
    const std::vector<float> whole = read(8), half = read(4), twice = read(16);
    EXPECT_EQ(whole[0], 10.0F / 255) << "no background through the fourth channel";
    EXPECT_EQ(whole[3 * 64 + 63], 80.0F / 255);
    EXPECT_EQ(whole[4 * 64 + 8], 2.0F / 8) << "the second of eight rows";
    for (std::size_t y = 0; y < 4; ++y)
        for (std::size_t x = 0; x < 4; ++x) {
            const std::size_t i = 4 * y + x;
            EXPECT_EQ(half[i], static_cast<float>(20 * (y + 1)) / 255) << "rows 1, 3, 5 and 7";
            EXPECT_EQ(half[4 * 16 + i], static_cast<float>(y + 1) / 4) << "of the planes left";
            EXPECT_EQ(half[5 * 16 + i], static_cast<float>(70 - 20 * y) / 255) << "view 1";
        }
    for (std::size_t i = 0; i < 256; ++i)
        EXPECT_EQ(twice[i], whole[i / 16 / 2 * 8 + i % 16 / 2]) << "no plane between two";
}

TEST_F(PlaneMaps, OfArraysHaveNormalsAndDistances) {
    std::vector<float> numbers;  // two planes, a pixel of neither
    for (int i = 0; i < 64; ++i)
        numbers.insert(numbers.end(), {0, 0.6F, -0.8F, i < 32 ? 4.0F : 1e-6F});
    numbers[3] = 0;
    for (const char* name : {"000000", "000001"}) {
        fs::remove(object_ / "plane" / (std::string(name) + ".png"));
        put_npy(object_ / "plane" / (std::string(name) + ".npy"), {8, 8, 4}, numbers);
    }
    const std::vector<float> planes = read(8);
    for (std::size_t c = 0; c < 5; ++c) EXPECT_EQ(planes[64 * c], 0) << "a distance of 0";
    EXPECT_EQ(planes[64 + 1], 204.0F / 255) << "(0.6 + 1) / 2";
    EXPECT_EQ(planes[3 * 64 + 1], 1) << "the farthest";
    EXPECT_EQ(planes[3 * 64 + 63], 1.0F / 255) << "at least";
    EXPECT_EQ(planes[4 * 64 + 1], 1) << "31 pixels";
    EXPECT_EQ(planes[4 * 64 + 63], 0.5F) << "32 pixels";
}

TEST_F(PlaneMaps, OfOtherChannelsAreRefused) {
    put_image(object_ / "plane/000001.png", 8, 3);
    const auto dataset = open_data(folder_.path());
    std::vector<float> planes(320);
    const std::uint32_t view = 1;
    const char* const sentence =
        "plane/000001.png': 3 channels, expected 4 of a map of planes: normal and distance";
    EXPECT_ERROR(dataset->read(0, {&view, 1}, {.planes = planes.data()}), Code::kFormat, sentence);
    const auto found = need(check_object(*dataset, 0));
    ASSERT_EQ(found.problems.size(), 1U);
    EXPECT_HAS(found.problems[0], sentence);
    fs::remove(object_ / "plane/000001.png");
    put_npy(object_ / "plane/000001.npy", {8, 8, 3}, std::vector<float>(192));
    EXPECT_ERROR(open_data(folder_.path())->read(0, {&view, 1}, {.planes = planes.data()}),
                 Code::kFormat, "8 x 8 numbers of 3 channels, expected 4 channels");
}

TEST_F(PlaneMaps, ThatLackAreNamedWithWhatMakesThem) {
    fs::remove_all(object_ / "plane");
    DatasetDesc desc = data_desc(folder_.path());
    desc.maps = flag_of(MapKind::kPlane);
    const auto status = Dataset::open(desc).status();
    EXPECT_EQ(status.code(), Code::kNotFound);
    EXPECT_HAS(status.message(), "maps requested: plane");
    EXPECT_HAS(status.message(), (object_ / "plane").generic_string());
    EXPECT_HAS(status.message(), "'vkrun priors plane' makes plane maps, beside rgb/ folders");
}

/// What a loss would refuse in the middle of a training.
TEST_F(PlaneMaps, OfTooManyPlanesOrOfShortNormalsAreRefused) {
    for (const char* name : {"000000.png", "000001.png"}) put_image(object_ / "rgb" / name, 16, 3);
    io::Image many{16, 16, 4, 8, {}}, mixed = many;
    const auto short_from = [](std::uint16_t i) -> std::uint16_t { return i < 37 ? 0 : 102; };
    for (std::uint16_t i = 0; i < 256; ++i) {
        many.samples.insert(many.samples.end(), {0, i, 0, 255});
        mixed.samples.insert(mixed.samples.end(), {127, short_from(i), 127, 1});
    }
    put_png(object_ / "plane/000000.png", many);
    put_png(object_ / "plane/000001.png", mixed);
    const char* const sentences[] = {
        "plane/000000.png': pixel (15, 15) begins plane 256, expected at most 255: maps that were "
        "resized mix planes; make them with 'vkrun priors plane'",
        "plane/000001.png': pixel (5, 2) is on a plane whose normal has the length 0.2, expected "
        "about 1: "};
    const auto dataset = open_data(folder_.path());
    std::vector<float> planes(5 * std::size_t{256});
    for (const std::uint32_t view : {0U, 1U})
        EXPECT_ERROR(dataset->read(0, {&view, 1}, {.planes = planes.data()}), Code::kFormat,
                     sentences[view]);
    const auto found = need(check_object(*dataset, 0));
    ASSERT_EQ(found.problems.size(), 2U);
    for (const std::size_t view : {0, 1}) EXPECT_HAS(found.problems[view], sentences[view]);
    for (std::size_t i = 3; i < 1024; i += 4) mixed.samples[i] = 0;
    put_png(object_ / "plane/000001.png", mixed);
    const std::uint32_t view = 1;
    EXPECT_OK(open_data(folder_.path())->read(0, {&view, 1}, {.planes = planes.data()}))
        << "no plane, no normal";
    many.samples[1020 + 1] = 254;  // the pixel before has it, too
    put_png(object_ / "plane/000000.png", many);
    EXPECT_TRUE(need(check_object(*open_data(folder_.path()), 0)).problems.empty());
}

TEST_F(PlaneMaps, Of16BitsKeepSmallDistances) {
    io::Image map{8, 8, 4, 16, {}};
    for (int i = 0; i < 64; ++i) {
        const int distance = i < 32 ? 65535 : i < 63 ? 1 : 0;
        map.samples.insert(map.samples.end(), {0, 0, 0, static_cast<std::uint16_t>(distance)});
    }
    for (const char* name : {"000000.png", "000001.png"}) put_png(object_ / "plane" / name, map);
    const std::vector<float> planes = read(8);
    EXPECT_EQ(planes[3 * 64], 1);
    EXPECT_EQ(planes[3 * 64 + 32], 1.0F / 255);
    EXPECT_EQ(planes[4 * 64 + 32], 1) << "31 pixels";
    EXPECT_EQ(planes[4 * 64 + 63], 0) << "no plane";
}

TEST_F(PlaneMaps, AreNotExportedWhichIsTold) {
    const auto dataset = open_data(folder_.path());
    EXPECT_EQ(dataset->index().maps, flag_of(MapKind::kPlane));
    EXPECT_HAS(report_text(*dataset), "\"plane\"");
    const LogCapture log;
    ExportDesc desc;
    desc.path = (folder_ / "out").string();
    desc.layout = Layout::kStore;
    ASSERT_OK(export_dataset(*dataset, desc, nullptr));
    EXPECT_HAS(log.text(), "plane maps are not exported");
    DatasetDesc store = data_desc(folder_ / "out");
    EXPECT_EQ(open_data(store)->index().maps, 0U);
    store.maps = flag_of(MapKind::kPlane);
    EXPECT_ERROR(Dataset::open(store).status(), Code::kNotFound, "every object has: none");
}

}  // namespace
}  // namespace splat::data

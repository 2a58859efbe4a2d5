// Scores of maps through the C API: layouts, encodings and flags; tests/prior_scores tests numbers. Needs no device.
#include <cmath>

#include "api/api_calls.h"
#include "support/golden_file.h"

namespace splat::test {
namespace {

splat_depth_scores depth_scores(Floats p, Floats g, Floats mask = {}, std::uint32_t flags = 0) {
    const auto width = static_cast<std::uint32_t>(p.size());
    const splat_image a = packed_image(p, width, 1, 1), b = packed_image(g, width, 1, 1);
    const splat_image m = packed_image(mask, width, 1, 1);
    const auto scores = got(splat_prior_compare_depth, &a, &b, mask.empty() ? nullptr : &m, flags);
    return scores;
}

TEST(ApiPriors, DepthScoresHaveTheirPlaces) {
    // The mean, 2, is predicted: |p - g| / g are 1, 0, 1/3; ratios 2, 1, 1.5.
    const splat_depth_scores scores = depth_scores({5, 5, 5, 5}, {1, 2, 3, 0});
    EXPECT_EQ(scores.pixels, 3U);
    EXPECT_NEAR(scores.abs_rel, 4.0 / 9, 1e-15);
    EXPECT_NEAR(scores.rmse, std::sqrt(2.0 / 3), 1e-15);
    EXPECT_GT(scores.si_rmse, 0.4);
    EXPECT_NEAR(scores.within[0], 1.0 / 3, 1e-15);
    EXPECT_NEAR(scores.within[2], 2.0 / 3, 1e-15);
    EXPECT_EQ(scores.scale, 0);
    EXPECT_EQ(scores.shift, 2);
    EXPECT_EQ(depth_scores({5, 5, 5, 5}, {1, 2, 3, 0}, {0, 1, 1, 0}).pixels, 2U);
    EXPECT_EQ(depth_scores({5, 5, 5, 5}, {1, 2, 3, 0}, {}, SPLAT_DEPTH_AS_PUBLISHED).pixels, 4U);
}

TEST(ApiPriors, NormalsAreEncodedOrVectors) {
    // x and z: 90 degrees. The second pixel has no normal.
    Floats truth = {1, 0.5F, 0.5F, 0.5F, 0.5F, 0.5F}, p = {0.5F, 0.5F, 1, 0.5F, 0.5F, 0.5F};
    const splat_image a = packed_image(p, 2, 1, 3), b = packed_image(truth, 2, 1, 3);
    const auto scores = got(splat_prior_compare_normals, &a, &b, nullptr, 0);
    EXPECT_EQ(scores.pixels, 1U);
    EXPECT_NEAR(scores.mean, 90, 1e-9);
    EXPECT_NEAR(scores.median, 90, 1e-9);
    EXPECT_NEAR(scores.rmse, 90, 1e-9);
    EXPECT_EQ(scores.within[2], 0);
    EXPECT_EQ(scores.missing, 0U);
    for (Floats* map : {&truth, &p})
        for (float& x : *map) x = 2 * x - 1;
    auto vectors = got(splat_prior_compare_normals, &a, &b, nullptr, SPLAT_NORMAL_VECTORS);
    EXPECT_EQ(vectors.mean, scores.mean);
    EXPECT_EQ(vectors.pixels, 1U);
    Floats second = {0, 1};
    const splat_image mask = packed_image(second, 2, 1, 1);
    EXPECT_REFUSED(splat_prior_compare_normals(&a, &b, &mask, SPLAT_NORMAL_VECTORS, &vectors),
                   kArgument, "the true normal of pixel 1");
}

TEST(ApiPriors, NormalsOfBytes) {
    // 128 stands for 0.004: still no normal.
    std::vector<unsigned char> truth = {128, 128, 255, 128, 128, 128},
                               p = {128, 128, 0, 255, 128, 128};
    const splat_image a = packed_image(p, 2, 1, 3), b = packed_image(truth, 2, 1, 3);
    const auto scores = got(splat_prior_compare_normals, &a, &b, nullptr, 0);
    EXPECT_EQ(scores.pixels, 1U);
    EXPECT_GT(scores.mean, 179);
}

TEST(ApiPriors, PlanesAreEncodedOrVectors) {
    // Two planes of two pixels; of the second one pixel is missing.
    Floats truth = {0, 0, -1, 2, 0, 0, -1, 2, 1, 0, 0, 3, 1, 0, 0, 3}, p = truth;
    std::fill(p.begin() + 12, p.end(), 0.0F);
    const splat_image a = packed_image(p, 4, 1, 4), b = packed_image(truth, 4, 1, 4);
    auto scores = got(splat_prior_compare_planes, &a, &b, SPLAT_NORMAL_VECTORS, 0.05, 10);
    EXPECT_EQ(scores.pixels, 4U);
    EXPECT_EQ(scores.predicted_planes, 2U);
    EXPECT_EQ(scores.true_planes, 2U);
    EXPECT_EQ(scores.covering, 0.75);
    EXPECT_EQ(scores.recall, 0.5);
    EXPECT_EQ(scores.precision, 0.5);
    for (Floats* map : {&truth, &p})
        for (std::size_t i = 0; i < map->size(); ++i)
            if (i % 4 != 3) (*map)[i] = ((*map)[i] + 1) / 2;
    EXPECT_EQ(got(splat_prior_compare_planes, &a, &b, 0, 0.05, 10).covering, 0.75);
}

TEST(ApiPriors, MasksOfBytesAndTheirAlpha) {
    std::vector<unsigned char> p = {255, 255, 0, 0}, alpha = {255, 100, 1, 0};
    const splat_image a = packed_image(p, 2, 2, 1), b = packed_image(alpha, 2, 2, 1);
    auto any = sized<splat_mask_scores>(), half = sized<splat_mask_scores>();
    ASSERT_DONE(splat_prior_compare_masks(&a, &b, 0, &any));
    ASSERT_DONE(splat_prior_compare_masks(&a, &b, SPLAT_MASK_ALPHA_HALF, &half));
    EXPECT_EQ(any.true_pixels, 3U);
    EXPECT_EQ(any.predicted_pixels, 2U);
    EXPECT_EQ(any.mae, 0.25);
    EXPECT_NEAR(any.iou, 2.0 / 3, 1e-6);
    EXPECT_NEAR(any.precision, 1, 1e-6);
    EXPECT_NEAR(any.recall, 2.0 / 3, 1e-6);
    EXPECT_EQ(any.f_beta,
              1.3 * any.precision * any.recall / (0.3 * any.precision + any.recall + 1e-6));
    EXPECT_EQ(half.true_pixels, 1U);
    EXPECT_NEAR(half.iou, 0.5, 1e-6);
}

TEST(ApiPriors, FidelityOfPlanesOfTheGoldenFile) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    each_golden("prior", [](const Golden& golden) {
        Floats p = golden.floats("vif.pred"), t = golden.floats("vif.gt");
        const std::uint32_t height = golden.dim("vif.gt", 1), width = golden.dim("vif.gt", 2);
        const auto planes = [&](Floats& pixels) {
            splat_image image = packed_image(pixels, width, height, 3);
            image.row_stride = 4 * std::int64_t{width};
            image.pixel_stride = 4;
            image.channel_stride = 4 * std::int64_t{width} * height;
            return image;
        };
        const splat_image a = planes(p), b = planes(t);
        auto scores = sized<splat_fidelity_scores>(), published = scores;
        ASSERT_DONE(splat_prior_compare_images(&a, &b, 0, &scores));
        ASSERT_DONE(splat_prior_compare_images(
            &a, &b, SPLAT_FIDELITY_RANGE_1 | SPLAT_FIDELITY_WITH_ALPHA, &published));
        EXPECT_NEAR(scores.vif, golden.doubles("vif.mean255")[0], 1e-12);
        EXPECT_NEAR(published.vif, golden.doubles("vif.mean64")[0], 1e-12);
        EXPECT_NEAR(published.channels[2], golden.doubles("vif.channels64")[2], 1e-12);
        EXPECT_TRUE(std::isnan(published.channels[3]));
        EXPECT_EQ(scores.constant_channels, 0U);
    });
}

TEST(ApiPriors, EveryFilterWritesTheCallersPicture) {
    // A square of 3 x 3 in the middle of 9 x 7, with a hole.
    Floats map(9 * 7);
    for (std::size_t y = 2; y < 5; ++y)
        for (std::size_t x = 3; x < 6; ++x) map[9 * y + x] = 1;
    const Floats square = map;
    map[9 * 3 + 4] = 0;
    const splat_image in = packed_image(map, 9, 7, 1);
    Floats filtered(map.size());
    splat_image out = packed_image(filtered, 9, 7, 1);
    ASSERT_DONE(splat_prior_filter(&in, SPLAT_MAP_FILTER_CLOSING, &out));
    EXPECT_EQ(filtered, square);
    ASSERT_DONE(splat_prior_filter(&in, SPLAT_MAP_FILTER_OPENING, &out));
    EXPECT_EQ(filtered, Floats(map.size()));
    for (const splat_map_filter kind :
         {SPLAT_MAP_FILTER_SOBEL, SPLAT_MAP_FILTER_SCHARR, SPLAT_MAP_FILTER_PREWITT}) {
        ASSERT_DONE(splat_prior_filter(&in, kind, &out));
        EXPECT_FLOAT_EQ(*std::max_element(filtered.begin(), filtered.end()), 1);
        EXPECT_EQ(filtered[9 * 3 + 4], 0) << "the square is symmetric";
    }
    std::vector<unsigned char> bytes(map.size());
    splat_image byte_out = packed_image(bytes, 9, 7, 1);
    ASSERT_DONE(splat_prior_filter(&in, SPLAT_MAP_FILTER_CANNY, &byte_out));
    for (const unsigned char byte : bytes) EXPECT_TRUE(byte == 0 || byte == 255);
    EXPECT_GT(std::count(bytes.begin(), bytes.end(), 255), 0);
}

TEST(ApiPriors, AMapMayBeFilteredInPlace) {
    Floats map(25);
    map[12] = 1;
    const splat_image in = packed_image(map, 5, 5, 1);
    splat_image out = in;
    ASSERT_DONE(splat_prior_filter(&in, SPLAT_MAP_FILTER_SOBEL, &out));
    EXPECT_EQ(map[12], 0) << "the gradient vanishes on a peak";
    EXPECT_FLOAT_EQ(map[7], 1);
}

}  // namespace
}  // namespace splat::test

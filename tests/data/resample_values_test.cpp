#include "data/resample.h"

#include <gtest/gtest.h>

#include <cmath>

#include "ref/images/priors_ref.h"
#include "support/golden_file.h"

namespace splat::data {
namespace {

std::vector<float> drawn_values(std::size_t count) {
    std::vector<float> values;
    for (std::size_t i = 0; i < count; ++i)
        values.push_back(static_cast<float>(std::sin(12.9898 * static_cast<double>(i + 1))));
    return values;
}

std::vector<double> resampled(const std::vector<float>& values, std::uint32_t width,
                              std::uint32_t height, std::uint32_t channels, std::uint32_t to_width,
                              std::uint32_t to_height, ValueFilter filter) {
    return need(resample_values(std::span<const float>(values), width, height, channels, to_width,
                                to_height, filter));
}

TEST(ResampleValues, EqualsTheReference) {
    const std::vector<float> values = drawn_values(9 * 6 * 3);
    const ref::Pixels from{9, 6, 3, {values.begin(), values.end()}};
    for (const auto& [w, h] : {std::pair{4U, 3U}, {20U, 13U}, {9U, 11U}, {1U, 1U}}) {
        const double sx = 9.0 / w, sy = 6.0 / h;
        const std::pair<ValueFilter, ref::Pixels> cases[] = {
            {ValueFilter::kCubic, ref::cubic_resize(from, w, h)},
            {ValueFilter::kLinearOrigin, ref::linear_resize(from, w, h, sx, sy, 0)},
            {ValueFilter::kLinearCorners, ref::linear_resize(from, w, h, w == 1 ? 0 : 8.0 / (w - 1),
                                                             h == 1 ? 0 : 5.0 / (h - 1), 0)}};
        for (const auto& [filter, expected] : cases) {
            const std::vector<double> found = resampled(values, 9, 6, 3, w, h, filter);
            ASSERT_EQ(found.size(), expected.values.size());
            for (std::size_t i = 0; i < found.size(); ++i)
                EXPECT_NEAR(found[i], expected.values[i], 1e-12) << static_cast<int>(filter);
        }
    }
}

TEST(ResampleValues, LinearHasTheMiddlesOfPixels) {
    // Twice as wide: a quarter and three quarters between neighbours, the ends repeated.
    EXPECT_EQ(resampled({0, 4, 8}, 3, 1, 1, 6, 1, ValueFilter::kLinear),
              (std::vector<double>{0, 1, 3, 5, 7, 8}));
    EXPECT_EQ(resampled({0, 4, 8, 12}, 4, 1, 1, 2, 1, ValueFilter::kLinear),
              (std::vector<double>{2, 10}));
}

TEST(ResampleValues, PillowsKernelsAreThoseOfImagesBeforeRounding) {
    std::vector<float> values;
    io::Image image{11, 8, 1, 8, {}, 0};
    for (const float value : drawn_values(88)) {
        image.samples.push_back(static_cast<std::uint16_t>(127.5F + 100 * value));
        values.push_back(image.samples.back());
    }
    const std::pair<ValueFilter, Filter> filters[] = {
        {ValueFilter::kPillowBilinear, Filter::kBilinear},
        {ValueFilter::kPillowBicubic, Filter::kBicubic},
        {ValueFilter::kPillowLanczos, Filter::kLanczos}};
    for (const auto& [mine, pillows] : filters)
        for (const std::uint32_t size : {4U, 30U}) {
            const std::vector<double> found = resampled(values, 11, 8, 1, size, 8, mine);
            const auto expected = resample(image, size, 8, pillows).value().samples;
            for (std::size_t i = 0; i < found.size(); ++i)
                EXPECT_LE(std::abs(std::clamp(found[i], 0.0, 255.0) - expected[i]), 0.5001);
        }
}

TEST(ResampleValues, RefusesSizesThatDoNotFit) {
    const std::vector<float> values(6);
    const std::span<const float> span(values);
    EXPECT_ERROR(resample_values(span, 2, 2, 1, 1, 1, ValueFilter::kCubic), Code::kInvalidArgument,
                 "6 numbers");
    EXPECT_ERROR(resample_values(span, 3, 2, 1, 0, 1, ValueFilter::kCubic), Code::kInvalidArgument,
                 "0 x 1");
}

TEST(ResampleValues, HasNames) {
    EXPECT_EQ(value_filter_of("pillow_lanczos"), ValueFilter::kPillowLanczos);
    EXPECT_EQ(value_filter_of("cubic"), ValueFilter::kCubic);
    EXPECT_EQ(value_filter_of("lanczos"), std::nullopt);
}

TEST(GoldenNetResample, GivesOpenCvsNumbersAndPillowsNearest) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    test::each_golden("prior", [](const test::Golden& golden) {
        const std::vector<std::int64_t> samples = golden.array("dpt.rgb").ints().value();
        const std::vector<float> values(samples.begin(), samples.end());
        const std::uint32_t width = golden.dim("dpt.rgb", 1), height = golden.dim("dpt.rgb", 0);
        const auto found = resampled(values, width, height, 3, golden.dim("dpt.resized", 1),
                                     golden.dim("dpt.resized", 0), ValueFilter::kCubic);
        const std::vector<double> expected = golden.doubles("dpt.resized");
        ASSERT_EQ(found.size(), expected.size());
        for (std::size_t i = 0; i < found.size(); ++i)  // OpenCV's weights are float32
            EXPECT_NEAR(found[i] / 255, expected[i], 1e-6);
        for (const char* key : {"pil.nearest_dn", "pil.nearest_up"}) {
            const std::vector<std::int64_t> bytes = golden.array(key).ints().value();
            const auto nearest = resampled(values, width, height, 3, golden.dim(key, 1),
                                           golden.dim(key, 0), ValueFilter::kNearest);
            EXPECT_EQ(std::vector<std::int64_t>(nearest.begin(), nearest.end()), bytes) << key;
        }
    });
}

}  // namespace
}  // namespace splat::data

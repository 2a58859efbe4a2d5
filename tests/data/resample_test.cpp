// Pillow's fixed point: weights are computed in float64, normalised to a sum of 1, multiplied by 2^22 and
// rounded away from zero; each pass adds 2^21, shifts by 22 and clamps to 0..255. RGBA is multiplied by
// alpha before and divided after it. GoldenNetCameras holds it to images that Pillow made.
#include "data/resample.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "support/expect_status.h"
#include "support/golden_file.h"

namespace splat::data {
namespace {

io::Image image_of(std::uint32_t width, std::uint32_t height, std::uint32_t channels,
                   std::vector<std::uint16_t> samples) {
    return {width, height, channels, 8, std::move(samples)};
}

io::Image even(std::uint32_t width, std::uint32_t height, std::uint16_t value) {
    return image_of(width, height, 1,
                    std::vector<std::uint16_t>(std::size_t{width} * height, value));
}

constexpr Filter kFilters[] = {Filter::kBox, Filter::kBilinear, Filter::kBicubic, Filter::kLanczos};

TEST(Resample, KeepsUniformImagesAndTheirSize) {
    for (const Filter filter : kFilters)
        for (const std::uint32_t size : {1U, 3U, 7U, 20U}) {
            const auto out = need(resample(even(9, 5, 201), size, 2 * size, filter));
            EXPECT_EQ(out.samples, even(size, 2 * size, 201).samples);
        }
    const io::Image same = image_of(2, 1, 4, {1, 2, 3, 4, 5, 6, 7, 0});
    EXPECT_EQ(resample(same, 2, 1, Filter::kLanczos).value().samples, same.samples);
}

TEST(Resample, HalvesByMeansOfTheKernel) {
    const io::Image row = image_of(8, 1, 1, {0, 100, 200, 40, 80, 120, 10, 250});
    EXPECT_EQ(resample(row, 4, 1, Filter::kBox).value().samples,
              (std::vector<std::uint16_t>{50, 120, 100, 130}));
    // Bilinear at half size: weights 1 3 3 1 of 8, those beyond the end left out and the rest normalised.
    EXPECT_EQ(resample(row, 4, 1, Filter::kBilinear).value().samples,
              (std::vector<std::uint16_t>{71, 113, 81, 129}));
}

TEST(Resample, MirrorsWithTheImage) {
    std::vector<std::uint16_t> samples;
    for (std::uint32_t i = 0; i < 11; ++i) samples.push_back((i * 97 + 31) % 256);
    std::vector<std::uint16_t> mirrored(samples.rbegin(), samples.rend());
    for (const Filter filter : {Filter::kBilinear, Filter::kBicubic, Filter::kLanczos})
        for (const std::uint32_t size : {4U, 5U, 17U}) {
            auto a = resample(image_of(11, 1, 1, samples), size, 1, filter).value().samples;
            const auto b = resample(image_of(1, 11, 1, mirrored), 1, size, filter).value().samples;
            std::reverse(a.begin(), a.end());
            EXPECT_EQ(a, b) << "along rows and along columns";
        }
}

TEST(Resample, OvershootsAreClamped) {
    const io::Image edge = image_of(8, 1, 1, {0, 0, 0, 0, 255, 255, 255, 255});
    const auto out = resample(edge, 32, 1, Filter::kLanczos).value();
    for (const std::uint16_t sample : out.samples) EXPECT_LE(sample, 255);
    EXPECT_EQ(out.samples.front(), 0);
    EXPECT_EQ(out.samples.back(), 255);
}

TEST(Resample, TransparentColoursDoNotShine) {
    const io::Image image = image_of(2, 1, 4, {200, 10, 0, 255, 0, 250, 9, 0});
    EXPECT_EQ(resample(image, 1, 1, Filter::kBox).value().samples,
              (std::vector<std::uint16_t>{199, 9, 0, 128}))
        << "of the opaque pixel, up to the rounding of halves";
}

TEST(Resample, RefusesInvalidImagesAndSizes) {
    io::Image deep = even(2, 2, 9);
    deep.bits = 16;
    EXPECT_ERROR(resample(deep, 1, 1, Filter::kBox), Code::kInvalidArgument, "16 bits");
    EXPECT_ERROR(resample(even(2, 2, 9), 0, 1, Filter::kBox), Code::kInvalidArgument, "0 x 1");
}

TEST(GoldenNetResample, GivesPillowsBytes) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    const std::pair<const char*, Filter> filters[] = {{"bilinear", Filter::kBilinear},
                                                      {"bicubic", Filter::kBicubic},
                                                      {"lanczos", Filter::kLanczos}};
    test::each_golden("prior", [&](const test::Golden& golden) {
        const auto image = [&golden](const std::string& name) {
            const std::vector<std::int64_t> samples = golden.array(name).ints().value();
            return image_of(golden.dim(name, 1), golden.dim(name, 0), golden.dim(name, 2),
                            {samples.begin(), samples.end()});
        };
        const io::Image source = image("dpt.rgb");
        for (const auto& [name, filter] : filters)
            for (const char* direction : {"_dn", "_up"}) {
                const io::Image expected = image(std::string("pil.") + name + direction);
                const auto found = need(resample(source, expected.width, expected.height, filter));
                EXPECT_EQ(found.samples, expected.samples) << name << direction;
            }
    });
}

}  // namespace
}  // namespace splat::data

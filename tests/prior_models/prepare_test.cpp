#include "prior_models/prepare.h"

#include <gtest/gtest.h>

#include "ref/images/priors_ref.h"
#include "support/golden_file.h"

namespace splat::prior_models {
namespace {

io::Image golden_picture(const test::Golden& golden, const std::string& name) {
    const std::vector<std::int64_t> samples = golden.array(name).ints().value();
    return {golden.dim(name, 1),
            golden.dim(name, 0),
            golden.dim(name, 2),
            8,
            {samples.begin(), samples.end()},
            0};
}

io::Image drawn_picture(std::uint32_t width, std::uint32_t height, std::uint32_t channels) {
    io::Image picture{width, height, channels, 8, {}, 0};
    std::uint32_t state = 7;
    for (std::size_t i = 0; i < std::size_t{width} * height * channels; ++i) {
        state = state * 1664525U + 1013904223U;
        picture.samples.push_back(static_cast<std::uint16_t>((state >> 24U) % 201));
    }
    return picture;
}

TEST(GoldenNetPrior, PicturesBecomeTheReferencesInputs) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    test::each_golden("prior", [](const test::Golden& golden) {
        const io::Image picture = golden_picture(golden, "dpt.rgb");
        // float32 of values in [-2.2, 2.7]: an ulp, and that of OpenCV's float32 weights.
        const struct {
            const char *preset, *key;
            double figure;
        } cases[] = {{"midas-dpt-large", "dpt.input", 2e-6},
                     {"normal-uncertainty-scannet", "nrm.input", 5e-7}};
        for (const auto& one : cases) {
            PresetInput input = preset_of(one.preset).value().input;
            const Extent size{golden.dim(one.key, 2), golden.dim(one.key, 1)};
            const auto tensor = need(prepare(input, picture, size));
            EXPECT_EQ(tensor.dims, (std::vector<std::int64_t>{1, 3, size.height, size.width}));
            test::expect_absolute(one.key, tensor.values, golden.doubles(one.key), one.figure);
        }
    });
}

TEST(PriorInput, SizesFollowTheRulesOfMidas) {
    const PresetInput dpt = preset_of("midas-dpt-large").value().input;
    const PresetInput small = preset_of("midas-small-hub").value().input;
    PresetInput lower = small;
    lower.fit = Fit::kLowerBound;
    const auto size_of = [](const PresetInput& input, std::uint32_t width, std::uint32_t height) {
        return input_extent(input, {width, height}).value();
    };
    EXPECT_EQ(size_of(dpt, 128, 128), (Extent{384, 384}));
    // The side whose factor is nearer to 1: 384 / 640 = 0.6, 384 / 480 = 0.8.
    EXPECT_EQ(size_of(dpt, 640, 480), (Extent{512, 384}));
    EXPECT_EQ(size_of(dpt, 100, 300), (Extent{ref::midas_side(1.28 * 100), 384}));
    EXPECT_EQ(size_of(small, 640, 480), (Extent{256, 192}));
    EXPECT_EQ(size_of(small, 480, 640), (Extent{192, 256}));
    EXPECT_EQ(size_of(lower, 640, 480), (Extent{352, 256}));
    // 256 * 16 / 640 = 6.4 is no multiple: at least one.
    EXPECT_EQ(size_of(small, 640, 16), (Extent{256, 32}));
    // 16 * 5 / 2 = 40 pixels lie between 32 and 64: ties of 1.5 go to the even 2.
    EXPECT_EQ(size_of(small, 256, 48), (Extent{256, 64}));
    EXPECT_EQ(size_of(preset_of("u2net").value().input, 640, 16), (Extent{320, 320}));
    EXPECT_EQ(size_of(preset_of("moge-2-vits").value().input, 641, 16), (Extent{641, 16}));
    EXPECT_ERROR(input_extent(lower, {16384, 1}), Code::kUnsupported, "16384 x 1");
}

TEST(PriorInput, ScalesByThePictureAndKeepsTheOrderOfTheLayout) {
    PresetInput input = preset_of("u2net").value().input;
    const io::Image picture = drawn_picture(5, 4, 3);
    const auto planes = prepare(input, picture, {5, 4}).value();
    input.channels_last = true;
    const auto pixels = prepare(input, picture, {5, 4}).value();
    EXPECT_EQ(pixels.dims, (std::vector<std::int64_t>{1, 4, 5, 3}));
    const double most = *std::max_element(picture.samples.begin(), picture.samples.end());
    ASSERT_LT(most, 255) << "the picture shows nothing";
    for (std::size_t i = 0; i < 20; ++i)
        for (std::size_t c = 0; c < 3; ++c) {
            const auto expected = static_cast<float>(
                (picture.samples[3 * i + c] / most - input.mean[c]) / input.std[c]);
            EXPECT_EQ(planes.values[20 * c + i], expected);
            EXPECT_EQ(pixels.values[3 * i + c], expected);
        }
    const io::Image black{2, 2, 3, 8, std::vector<std::uint16_t>(12, 0), 0};
    const auto dark = prepare(input, black, {2, 2}).value();
    for (const float value : dark.values) EXPECT_TRUE(std::isfinite(value)) << "of a black picture";
}

TEST(PriorInput, LeavesAlphaOutAndRepeatsGray) {
    const PresetInput input = preset_of("midas-dpt-large").value().input;
    io::Image rgba = drawn_picture(6, 6, 4), rgb{6, 6, 3, 8, {}, 0}, gray{6, 6, 1, 8, {}, 0};
    io::Image three = gray;
    three.channels = 3;
    for (std::size_t i = 0; i < 36; ++i) {
        rgb.samples.insert(rgb.samples.end(),
                           {rgba.samples[4 * i], rgba.samples[4 * i + 1], rgba.samples[4 * i + 2]});
        gray.samples.push_back(rgba.samples[4 * i]);
        three.samples.insert(three.samples.end(), 3, rgba.samples[4 * i]);
    }
    EXPECT_EQ(prepare(input, rgba, {32, 32}).value().values,
              prepare(input, rgb, {32, 32}).value().values);
    EXPECT_EQ(prepare(input, gray, {32, 32}).value().values,
              prepare(input, three, {32, 32}).value().values);
}

TEST(PriorInput, TheNpmPackagesFilterStartsAtTheCorner) {
    const PresetInput input = preset_of("isnet-imgly").value().input;
    const io::Image picture = drawn_picture(5, 7, 3);
    const ref::Pixels from{5, 7, 3, {picture.samples.begin(), picture.samples.end()}};
    const ref::Pixels expected = ref::linear_resize(from, 8, 9, 5.0 / 8, 7.0 / 9, 0);
    const auto found = prepare(input, picture, {8, 9}).value();
    for (std::size_t i = 0; i < 72; ++i)
        for (std::size_t c = 0; c < 3; ++c)
            EXPECT_EQ(found.values[72 * c + i],
                      static_cast<float>((std::round(expected.values[3 * i + c]) - 128) / 256));
}

TEST(PriorInput, RefusesDeepPictures) {
    io::Image deep = drawn_picture(2, 2, 3);
    deep.bits = 16;
    EXPECT_ERROR(prepare(preset_of("u2net").value().input, deep, {2, 2}), Code::kInvalidArgument,
                 "16 bits");
}

}  // namespace
}  // namespace splat::prior_models

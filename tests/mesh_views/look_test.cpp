#include "mesh_views/look.h"

#include <gtest/gtest.h>

#include <set>

#include "mesh_views/sample_views.h"
#include "scene/srgb.h"

namespace splat::mesh_views {
namespace {

using Color = std::array<float, 3>;

ViewsDesc with_background(Background background) {
    ViewsDesc desc = test::sample_views("x");
    desc.background = background;
    return desc;
}

TEST(Look, BackgroundsAreWhatTheirNamesSay) {
    EXPECT_EQ(look_of(with_background(Background::kWhite), 0).at(3, 4, 16), (Color{1, 1, 1}));
    EXPECT_EQ(look_of(with_background(Background::kBlack), 0).at(3, 4, 16), (Color{0, 0, 0}));
    EXPECT_EQ(look_of(with_background(Background::kGray), 0).at(3, 4, 16),
              (Color{0.5F, 0.5F, 0.5F}));
    std::set<Color> plain;
    for (std::uint32_t view = 0; view < 20; ++view) {
        const Look look = look_of(with_background(Background::kPlain), view);
        EXPECT_EQ(look.at(0, 0, 16), look.at(15, 15, 16)) << view;
        plain.insert(look.at(0, 0, 16));
    }
    EXPECT_EQ(plain.size(), 20U) << "each view has its own";
}

TEST(Look, GradientsStayBetweenTheirEnds) {
    for (std::uint32_t view = 0; view < 50; ++view) {
        const Look look = look_of(with_background(Background::kGradient), view);
        EXPECT_NEAR(look.across * look.across + look.down * look.down, 1, 1e-12);
        std::set<Color> corners;
        for (const auto& [x, y] : {std::pair(0U, 0U), {15U, 0U}, {0U, 15U}, {15U, 15U}}) {
            const Color color = look.at(x, y, 16);
            corners.insert(color);
            for (std::size_t k = 0; k < 3; ++k) {
                EXPECT_GE(color[k], std::min(look.from[k], look.to[k]) - 1e-6F);
                EXPECT_LE(color[k], std::max(look.from[k], look.to[k]) + 1e-6F);
            }
        }
        EXPECT_GT(corners.size(), 1U) << view;
    }
}

TEST(Look, ExposuresStayInTheirRange) {
    ViewsDesc desc = test::sample_views("x");
    EXPECT_EQ(look_of(desc, 0).gain, 1);
    desc.exposure = 1;
    double least = 9, most = 0;
    for (std::uint32_t view = 0; view < 200; ++view) {
        const double gain = look_of(desc, view).gain;
        least = std::min(least, gain);
        most = std::max(most, gain);
    }
    EXPECT_GE(least, 0.5);
    EXPECT_LT(least, 0.55);
    EXPECT_LE(most, 2);
    EXPECT_GT(most, 1.85);
}

TEST(Look, ObjectsAreMixedWithTheirBackgroundInLinearLight) {
    Look look;
    look.from = look.to = {1, 1, 1};
    const auto half = static_cast<double>(scene::srgb_of_linear(0.5F));
    // Red, covered wholly, by half and not at all; over black, half of the linear light is left.
    const std::vector<float> color = {1, 0, 0, static_cast<float>(half), 0, 0, 0, 0, 0, 0, 0, 0};
    const io::Image image = over_background(color, std::vector<float>{1, 0.5F, 0, 0}, 2, look);
    const auto byte = static_cast<std::uint16_t>(std::lround(255 * half));
    EXPECT_EQ(image.samples, (std::vector<std::uint16_t>{255, 0, 0, 255, byte, byte, 255, 255, 255,
                                                         255, 255, 255}));
}

TEST(Look, BackgroundsAreMixedInLinearLight) {
    Look look;
    look.from = look.to = {0.5F, 0.5F, 0.5F};
    // Black, of which each pixel is covered by half: half of the background's linear light is left.
    const io::Image image =
        over_background(std::vector<float>(12), std::vector<float>(4, 0.5F), 2, look);
    const float left = scene::srgb_of_linear(0.5F * scene::linear_of_srgb(0.5F));
    const auto byte = static_cast<std::uint16_t>(std::lround(255 * static_cast<double>(left)));
    EXPECT_EQ(image.samples, std::vector<std::uint16_t>(12, byte));
}

TEST(Look, ExposureChangesTheObjectAlone) {
    Look look;
    look.from = look.to = {0.25F, 0.5F, 0.75F};
    look.gain = 2;
    const float quarter = scene::srgb_of_linear(0.25F), half = scene::srgb_of_linear(0.5F);
    const std::vector<float> color = {quarter, quarter, quarter, 0, 0, 0, 1, 1, 1, 0, 0, 0};
    const io::Image image = over_background(color, std::vector<float>{1, 0, 1, 0}, 2, look);
    const auto bright = static_cast<std::uint16_t>(std::lround(255 * static_cast<double>(half)));
    EXPECT_EQ(image.samples, (std::vector<std::uint16_t>{bright, bright, bright, 64, 128, 191, 255,
                                                         255, 255, 64, 128, 191}));
}

}  // namespace
}  // namespace splat::mesh_views

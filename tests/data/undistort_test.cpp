// Photographs without their lens, and smaller.
#include <gtest/gtest.h>

#include <cmath>

#include "data/posed_photos.h"

namespace splat::data {
namespace {

constexpr std::uint32_t kThere = 255U << 24;

/// A photograph whose pixel in column x and row y is red(x, y), of a camera with these intrinsics.
template <class Red>
PosedPhoto photo_of(std::uint32_t width, std::uint32_t height, const Red& red) {
    PosedPhoto photo{"a", {"a", width, height, 20, 21, 7, 5, {}}, true, width, height, {}};
    for (std::uint32_t y = 0; y < height; ++y)
        for (std::uint32_t x = 0; x < width; ++x)
            photo.pixels.push_back(kThere | static_cast<std::uint32_t>(red(x, y)));
    return photo;
}

std::uint32_t channel(std::uint32_t pixel, unsigned index) {
    return pixel >> 8 * index & 255U;
}

TEST(Reduce, TakesMeansOfBlocksInTheMiddle) {
    PosedPhoto photo = photo_of(8, 5, [](auto x, auto y) { return 10 * y + x; });
    for (std::uint32_t& pixel : photo.pixels) pixel |= 200U << 8 | 255U << 16;
    photo.pixels[2 * 8 + 6] = 0;
    const PosedPhoto half = reduce(photo, 2);
    EXPECT_EQ(half.name, "a");
    EXPECT_TRUE(half.held_out);
    EXPECT_EQ(half.width, 4U);
    EXPECT_EQ(half.height, 2U) << "5 rows have one too many, the last";
    EXPECT_EQ(half.camera.width, 4U);
    EXPECT_EQ(half.camera.height, 2U);
    EXPECT_EQ(half.camera.fx, 10);
    EXPECT_EQ(half.camera.fy, 10.5);
    EXPECT_EQ(half.camera.cx, 3.5);
    EXPECT_EQ(half.camera.cy, 2.5);
    ASSERT_EQ(half.pixels.size(), 8U);
    EXPECT_EQ(half.pixels[0], kThere | 6U | 200U << 8 | 255U << 16)
        << "of 0, 1, 10, 11: 5.5 rounds up";
    EXPECT_EQ(channel(half.pixels[5], 0), 28U) << "of 22, 23, 32, 33: 27.5";
    EXPECT_EQ(half.pixels[7], 0U) << "one of its four is not there";
    const PosedPhoto third = reduce(photo, 3);
    EXPECT_EQ(third.width, 2U);
    EXPECT_EQ(third.height, 1U);
    EXPECT_EQ(third.camera.cx, 2) << "a column is left out on both sides";
    EXPECT_EQ(third.camera.cy, (5 - 1) / 3.0);
    EXPECT_EQ(channel(third.pixels[0], 0), 22U);
    EXPECT_EQ(third.pixels[1], 0U);
    EXPECT_EQ(reduce(photo, 1).pixels, photo.pixels);
}

/// Colours that are linear in the place are exact between pixels, too.
TEST(Undistort, PutsEachPixelWhereTheLensHasIt) {
    const PosedPhoto photo = photo_of(15, 11, [](auto x, auto y) { return 10 * x + 9 * y; });
    scene::Lens lens;
    lens.radial = {0.3, -0.1, 0, 0};
    lens.tangential = {0.01, -0.02};
    const PosedPhoto straight = undistort(photo, lens);
    EXPECT_EQ(straight.camera.fx, 20);
    EXPECT_EQ(straight.camera.cx, 7);
    std::size_t there = 0;
    for (std::uint32_t j = 0; j < 11; ++j)
        for (std::uint32_t i = 0; i < 15; ++i) {
            const double x = (i + 0.5 - 7) / 20, y = (j + 0.5 - 5) / 21, r2 = x * x + y * y;
            const double factor = 1 + 0.3 * r2 - 0.1 * r2 * r2;
            const double u =
                20 * (x * factor + 2 * 0.01 * x * y - 0.02 * (r2 + 2 * x * x)) + 7 - 0.5;
            const double v =
                21 * (y * factor + 0.01 * (r2 + 2 * y * y) - 2 * 0.02 * x * y) + 5 - 0.5;
            const std::uint32_t pixel = straight.pixels[j * 15 + i];
            const bool inside = u >= 0 && v >= 0 && u <= 14 && v <= 10;
            EXPECT_EQ(pixel >> 24, inside ? 255U : 0U) << i << " " << j;
            if (!inside) continue;
            EXPECT_NEAR(channel(pixel, 0), 10 * u + 9 * v, 0.5001) << i << " " << j;
            ++there;
        }
    EXPECT_GT(there, 100U);
    EXPECT_LT(there, 15U * 11U) << "a lens that sees less at the border";
}

TEST(Undistort, MeansAreOfUnroundedValues) {
    const PosedPhoto photo = photo_of(12, 12, [](auto x, auto y) { return 5 * x + 7 * y; });
    scene::Lens lens;
    lens.radial = {-0.2, 0, 0, 0};
    const PosedPhoto half = undistort(photo, lens, 2);
    EXPECT_EQ(half.width, 6U);
    EXPECT_EQ(half.camera.fx, 10);
    for (std::uint32_t j = 0; j < 6; ++j)
        for (std::uint32_t i = 0; i < 6; ++i) {
            double mean = 0;
            for (const std::uint32_t k : {0U, 1U, 2U, 3U}) {
                const double x = (2 * i + k % 2 + 0.5 - 7) / 20, y = (2 * j + k / 2 + 0.5 - 5) / 21;
                const double factor = 1 - 0.2 * (x * x + y * y);
                mean += (5 * (20 * x * factor + 6.5) + 7 * (21 * y * factor + 4.5)) / 4;
            }
            const std::uint32_t pixel = half.pixels[j * 6 + i];
            if (pixel == 0) continue;
            EXPECT_NEAR(channel(pixel, 0), mean, 0.5001) << i << " " << j;
        }
    EXPECT_NE(half.pixels[2 * 6 + 3], 0U);
}

TEST(Undistort, LeavesOutWhatOneOfFourNeighboursLacks) {
    PosedPhoto photo = photo_of(8, 8, [](auto, auto) { return 100; });
    photo.camera.cx = photo.camera.cy = 4;
    photo.pixels[4 * 8 + 4] = 0;
    scene::Lens lens;
    lens.radial = {1e-3, 0, 0, 0};
    const PosedPhoto straight = undistort(photo, lens);
    for (std::uint32_t y = 1; y < 7; ++y)
        for (std::uint32_t x = 1; x < 7; ++x) {
            // Sources lie a little outwards, so that no other pixel reads the hole.
            const bool hole = x == 4 && y == 4;
            EXPECT_EQ(straight.pixels[y * 8 + x] == 0, hole) << x << " " << y;
        }
}

/// Beyond the fold of its polynomial the lens has other parts of the picture a second time.
TEST(Undistort, LeavesOutWhatFoldsBack) {
    PosedPhoto photo = photo_of(64, 64, [](auto, auto) { return 100; });
    photo.camera = {"a", 64, 64, 16, 16, 32, 32, {}};
    scene::Lens lens;
    lens.radial = {-0.3, 0, 0, 0};
    const PosedPhoto straight = undistort(photo, lens);
    const double fold = 16 / std::sqrt(0.9);
    for (std::uint32_t x = 32; x < 64; ++x) {
        const double r = std::hypot(x + 0.5 - 32, 0.5);
        if (std::abs(r - fold) < 0.5) continue;
        EXPECT_EQ(straight.pixels[32 * 64 + x] != 0, r < fold) << x;
    }
}

TEST(Undistort, FisheyeBecomesAPinhole) {
    // A fisheye's picture of a plane whose red grows to the right, 5 levels for each 0.1 of tan(angle).
    PosedPhoto photo = photo_of(101, 101, [](auto x, auto y) {
        const double u = (x + 0.5 - 50.5) / 40, v = (y + 0.5 - 50.5) / 40, a = std::hypot(u, v);
        return std::lround(128 + 50 * (a == 0 ? 0 : u / a * std::tan(std::min(a, 1.0))));
    });
    photo.camera = {"a", 101, 101, 40, 40, 50.5, 50.5, {}};
    const PosedPhoto straight = undistort(photo, {.kind = scene::LensKind::kFisheye});
    for (std::uint32_t y = 0; y < 101; y += 5)
        for (std::uint32_t x = 10; x < 91; ++x) {
            const double r = std::hypot(x + 0.5 - 50.5, y + 0.5 - 50.5) / 40;
            const double red = 128 + 50 * (x + 0.5 - 50.5) / 40;
            if (r >= 1) continue;
            EXPECT_NEAR(channel(straight.pixels[y * 101 + x], 0), red, 1.2);
        }
}

}  // namespace
}  // namespace splat::data

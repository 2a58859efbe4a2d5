#include "prior_models/point_depth.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "support/expect_status.h"

namespace splat::prior_models {
namespace {

constexpr std::uint32_t kWidth = 40, kHeight = 30;

/// The distance of a wavy wall.
double wall(std::size_t x, std::size_t y) {
    return 2 + 0.7 * std::sin(0.3 * static_cast<double>(x)) + 0.02 * static_cast<double>(y);
}

/// Points that a camera of focal length `focal` pixels sees, with a depth that lacks `shift`, and divided by `scale`.
Planes wall_points(double focal, double shift, double scale) {
    Planes points{{kWidth, kHeight}, 3, {}};
    for (std::size_t y = 0; y < kHeight; ++y)
        for (std::size_t x = 0; x < kWidth; ++x) {
            const double z = wall(x, y);
            const double u = (static_cast<double>(x) + 0.5 - kWidth / 2.0) / focal;
            const double v = (static_cast<double>(y) + 0.5 - kHeight / 2.0) / focal;
            for (const double value : {u * z, v * z, z - shift})
                points.values.push_back(static_cast<float>(value / scale));
        }
    return points;
}

TEST(PointDepth, FindsTheShiftOfACamera) {
    for (const double focal : {20.0, 45.0, 150.0})
        for (const double shift : {-3.0, 0.0, 1.1, 2.4}) {
            const NetworkTensor scale{{1}, {2.5F}};
            const MapSource source{nullptr, &scale, nullptr, 0};
            const auto made = need(point_depth(wall_points(focal, shift, 2.5), source, "points"));
            const Planes& depth = made.depth;
            EXPECT_TRUE(made.found);
            EXPECT_NEAR(made.focal * std::hypot(kWidth, kHeight) / 2, focal, 1e-3 * focal);
            EXPECT_NEAR(made.shift * 2.5, shift, 2e-3);
            for (std::size_t i = 0; i < depth.values.size(); ++i)
                EXPECT_NEAR(depth.values[i], wall(i % kWidth, i / kWidth), 2e-3)
                    << "focal length " << focal << ", shift " << shift;
        }
}

TEST(PointDepth, WhatTheMaskLeavesOutIsFarthest) {
    Planes points = wall_points(45, 1, 1);
    NetworkTensor mask{{1, kHeight, kWidth}, std::vector<float>(std::size_t{kWidth} * kHeight, 1)};
    for (std::size_t i = 0; i < kWidth; ++i) {
        mask.values[i] = 0.2F;
        points.values[3 * i + 2] = 1e6F;  // must not matter
    }
    const Planes depth = need(point_depth(points, {nullptr, nullptr, &mask, 0}, "points")).depth;
    double farthest = 0;
    for (std::size_t i = kWidth; i < std::size_t{kWidth} * kHeight; ++i)
        farthest = std::max(farthest, wall(i % kWidth, i / kWidth));
    for (std::size_t i = 0; i < kWidth; ++i) EXPECT_NEAR(depth.values[i], farthest, 2e-3);
}

TEST(PointDepth, FindsOnlyTheShiftOfAKnownCamera) {
    const double focal = 45 / (std::hypot(kWidth, kHeight) / 2);
    const auto made = need(point_depth(wall_points(45, 1.1, 1), {}, "points", focal));
    EXPECT_EQ(made.focal, focal);
    EXPECT_NEAR(made.shift, 1.1, 2e-3);
    // A camera of twice the focal length sees the same points farther away.
    EXPECT_GT(need(point_depth(wall_points(45, 1.1, 1), {}, "points", 2 * focal)).shift, 2);
}

/// Points that lie mirrored, which a focal length below 0 would fit.
TEST(PointDepth, TakesADefaultCameraWhereNoneFits) {
    Planes points = wall_points(45, 0, 1);
    for (std::size_t i = 0; i < points.values.size(); i += 3) {
        points.values[i] = -points.values[i];
        points.values[i + 1] = -points.values[i + 1];
    }
    const auto made = need(point_depth(points, {}, "points"));
    EXPECT_FALSE(made.found);
    const double pixels = made.focal * std::hypot(kWidth, kHeight) / 2;
    EXPECT_NEAR(2 * std::atan(kWidth / 2.0 / pixels) * 180 / std::numbers::pi, kOtherwiseDegrees,
                1e-9);
    for (const float z : made.depth.values) EXPECT_TRUE(z > 0 && std::isfinite(z));
}

/// A shift of the nearest point to the camera or behind it is never taken, however small its error.
TEST(PointDepth, StaysBeforeTheBarrier) {
    Planes points = wall_points(45, 1.1, 1);
    float nearest = HUGE_VALF;
    for (std::size_t i = 2; i < points.values.size(); i += 3)
        nearest = std::min(nearest, points.values[i]);
    for (std::size_t i = 0; i < points.values.size(); ++i)
        points.values[i] += 0.3F * std::sin(static_cast<float>(i));  // no camera fits well
    const auto made = need(point_depth(points, {}, "points"));
    for (std::size_t i = 2; i < points.values.size(); i += 3)
        nearest = std::min(nearest, points.values[i]);
    EXPECT_GT(static_cast<double>(nearest) + made.shift, 0);
    for (const float z : made.depth.values) EXPECT_GT(z, 0);
}

TEST(PointDepth, LeavesASinglePointWhereItIs) {
    const Planes points{{1, 1}, 3, {0.1F, 0.2F, 3}};
    const auto made = need(point_depth(points, {}, "points"));
    EXPECT_EQ(made.focal, 1);
    EXPECT_EQ(made.shift, 0);
    EXPECT_EQ(made.depth.values, std::vector<float>{3});
}

TEST(PointDepth, RefusesAnEmptyMaskAndOneOfAnotherSize) {
    const Planes points = wall_points(45, 0, 1);
    const NetworkTensor empty{{1, kHeight, kWidth},
                              std::vector<float>(std::size_t{kWidth} * kHeight, 0)};
    EXPECT_ERROR(point_depth(points, {nullptr, nullptr, &empty, 0}, "points"), Code::kInvalidState,
                 "no valid point");
    const NetworkTensor small{{1, 2, 2}, {1, 1, 1, 1}};
    EXPECT_ERROR(point_depth(points, {nullptr, nullptr, &small, 0}, "points"), Code::kFormat,
                 "2 x 2 pixels, expected the points' 40 x 30");
}

}  // namespace
}  // namespace splat::prior_models

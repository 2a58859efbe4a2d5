#include "fit/first_gaussians.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "scene/activate.h"
#include "scene/camera_pose.h"
#include "scene/sh.h"
#include "support/expect_status.h"

namespace splat::test {
namespace {

io::ColoredPoints grid(std::size_t side) {
    io::ColoredPoints points;
    for (std::size_t i = 0; i < side * side * side; ++i) {
        points.positions.emplace_back(2.0 * static_cast<double>(i % side),
                                      2.0 * static_cast<double>(i / side % side),
                                      2.0 * static_cast<double>(i / side / side));
        points.colors.push_back({static_cast<std::uint8_t>(i % 256), 0, 255});
    }
    return points;
}

TEST(FirstGaussians, AreAsLargeAsTheirNeighboursAreFar) {
    const scene::Gaussians made = fit::first_gaussians(grid(4), 1000, 0).value();
    ASSERT_EQ(made.count(), 64);
    for (std::size_t i = 0; i < 64; ++i) {
        for (std::size_t k = 0; k < 3; ++k)
            EXPECT_NEAR(made.log_scales[3 * i + k], std::log(2), 1e-6);
        EXPECT_NEAR(scene::opacity_of(static_cast<double>(made.opacity_logits[i])), 0.1, 1e-6);
        EXPECT_NEAR(0.5 + scene::kSh0 * static_cast<double>(made.sh[3 * i]),
                    static_cast<double>(i) / 255, 1e-6);
        EXPECT_NEAR(0.5 + scene::kSh0 * static_cast<double>(made.sh[3 * i + 2]), 1, 1e-6);
        EXPECT_EQ(made.rotations[4 * i], 1);
    }
}

TEST(FirstGaussians, AreDrawnByTheSeed) {
    const io::ColoredPoints points = grid(8);
    const scene::Gaussians a = fit::first_gaussians(points, 100, 1).value();
    const scene::Gaussians b = fit::first_gaussians(points, 100, 2).value();
    EXPECT_EQ(a.count(), 100);
    EXPECT_EQ(a.means, fit::first_gaussians(points, 100, 1).value().means);
    EXPECT_NE(a.means, b.means);
    std::set<std::vector<float>> places;
    for (std::size_t i = 0; i < 100; ++i)
        places.insert({a.means[3 * i], a.means[3 * i + 1], a.means[3 * i + 2]});
    EXPECT_EQ(places.size(), 100);
}

TEST(FirstGaussians, OfFewOrEqualPointsAreFinite) {
    io::ColoredPoints points;
    points.positions.assign(5, {1, 2, 3});
    points.colors.assign(5, {0, 0, 0});
    const scene::Gaussians made = fit::first_gaussians(points, 10, 0).value();
    for (const float scale : made.log_scales) EXPECT_TRUE(std::isfinite(scale));
    points.positions.resize(1);
    points.colors.resize(1);
    EXPECT_ERROR(fit::first_gaussians(points, 10, 0), Code::kInvalidArgument,
                 "1 points to begin with, expected at least 2");
}

TEST(FirstGaussians, RandomPointsLieWhereTheCamerasLook) {
    std::vector<scene::Camera> cameras;
    const scene::Vec3 target = {10, -20, 5};
    for (int i = 0; i < 8; ++i) {
        scene::Camera camera = scene::camera_from_fov(100, 80, 0.8).value();
        const double angle = i * 0.7;
        camera.world_to_camera =
            scene::look_at(target + scene::Vec3(4 * std::cos(angle), 1, 4 * std::sin(angle)),
                           target, scene::kUp)
                .value();
        cameras.push_back(camera);
    }
    const io::ColoredPoints points = fit::random_points(cameras, 500, 3);
    ASSERT_EQ(points.positions.size(), 500);
    scene::Vec3 mean(0);
    for (const scene::Vec3& place : points.positions) {
        EXPECT_LT(glm::length(place - target), 4);
        mean += place / 500.0;
    }
    EXPECT_LT(glm::length(mean - target), 0.5);  // places that only one camera sees are left out
}

}  // namespace
}  // namespace splat::test

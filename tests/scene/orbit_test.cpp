#include "scene/orbit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "scene/arrays.h"
#include "support/expect_status.h"

namespace splat::scene {
namespace {

constexpr float kOpaque = 4, kFaint = -6;  ///< logits: 0.98, and below 1/255

void add(Gaussians& scene, const Vec3& mean, float opacity_logit = kOpaque) {
    for (std::size_t k = 0; k < 3; ++k) scene.means.push_back(static_cast<float>(mean[k]));
    scene.log_scales.insert(scene.log_scales.end(), 3, -5.0F);
    scene.rotations.insert(scene.rotations.end(), {1, 0, 0, 0});
    scene.opacity_logits.push_back(opacity_logit);
    scene.sh.insert(scene.sh.end(), 3, 0.0F);
}

/// Most Gaussians in a body at the bottom, a few in a thin neck 4 units tall above it: its median lies in the body.
Gaussians guitar() {
    Gaussians scene;
    for (int i = 0; i < 900; ++i)
        add(scene, {std::sin(i * 1.0), 0.3 * std::cos(i * 2.0), 5 + 0.2 * std::sin(i * 3.0)});
    for (int i = 0; i <= 90; ++i) add(scene, {0.2, -4 * i / 90.0, 5});
    return scene;
}

/// The largest distance of a mean from the middle of the image, of half the image; infinite if one lies behind.
double fill_of(const Camera& c, const Gaussians& scene) {
    double most = 0;
    for (std::size_t i = 0; i < scene.count(); ++i) {
        const Vec3 mean = glm::make_vec3(&scene.means[3 * i]);
        const Vec3 q = rotation_of(c.world_to_camera) * mean + translation_of(c.world_to_camera);
        if (!(q[2] > 0)) return INFINITY;
        most = std::max({most, std::abs(c.fx * q[0] / q[2]) / (0.5 * c.width),
                         std::abs(c.fy * q[1] / q[2]) / (0.5 * c.height)});
    }
    return most;
}

double most_filled(const std::vector<Camera>& cameras, const Gaussians& scene) {
    double most = 0;
    for (const Camera& camera : cameras) most = std::max(most, fill_of(camera, scene));
    return most;
}

TEST(Orbit, EveryViewHoldsTheWholeScene) {
    const Gaussians scene = guitar();
    for (const double elevation : {-1.2, 0.0, 0.2, 1.5})
        for (const auto& [width, height] : {std::pair{300U, 200U}, std::pair{200U, 300U}}) {
            OrbitOptions options;
            options.count = 180;
            options.width = width;
            options.height = height;
            options.elevation = elevation;
            const auto cameras = need(orbit(scene, options));
            const double most = most_filled(cameras, scene);
            EXPECT_LE(most, kOrbitFill + 1e-9) << width << " x " << height << ", " << elevation;
            EXPECT_GT(most, kOrbitFill - 0.01) << width << " x " << height << ", " << elevation;
        }
}

TEST(Orbit, UpIsAnyDirection) {
    OrbitOptions options;
    options.up = {3, -1, 2};
    EXPECT_LE(most_filled(need(orbit(guitar(), options)), guitar()), kOrbitFill + 1e-9);
    options.up = {0, 0, 0};
    EXPECT_FALSE(orbit(guitar(), options).ok());
}

TEST(Orbit, WhatIsFarOrFaintDoesNotMakeTheSceneSmall) {
    Gaussians scene = guitar();
    const auto alone = need(orbit(scene));
    for (int i = 0; i < 10; ++i) add(scene, {100 + 5.0 * i, 0, 0});
    add(scene, {NAN, 0, 0});
    for (int i = 0; i < 3000; ++i) add(scene, {0, 3, 5}, kFaint);
    EXPECT_EQ(camera_center(alone[0]), camera_center(need(orbit(scene))[0]));
}

TEST(Orbit, BeginsBeforeTheSceneAndAboveIt) {
    Gaussians scene;
    add(scene, {0, 2, 3});
    add(scene, {2, 2, 3});
    OrbitOptions options;
    options.count = 7;
    options.width = 300;
    options.height = 200;
    for (const double distance : {0.0, 4.0}) {
        options.distance = distance;
        const auto cameras = need(orbit(scene, options));
        ASSERT_EQ(cameras.size(), 7U);
        for (const Camera& camera : cameras) {
            EXPECT_OK(check_camera(camera));
            const Vec3 eye = camera_center(camera);
            EXPECT_LT(eye[1], 2) << "above: -y is up";
            const double far = glm::distance(eye, Vec3(1, 2, 3));
            EXPECT_NEAR(far, distance > 0 ? distance : far, 1e-9);
        }
        EXPECT_NEAR(camera_center(cameras[0])[0], 1, 1e-9);
        EXPECT_LT(camera_center(cameras[0])[2], 3) << "before the scene";
        EXPECT_EQ(cameras[3].name, "003");
    }
    options.distance = -4;
    EXPECT_FALSE(orbit(scene, options).ok());
}

TEST(Orbit, InvisibleScenesAreFramedAsIfVisible) {
    Gaussians visible, invisible;
    for (const float x : {0.0F, 2.0F}) {
        add(visible, {x, 2, 3});
        add(invisible, {x, 2, 3}, kFaint);
    }
    EXPECT_EQ(camera_center(need(orbit(invisible))[0]), camera_center(orbit(visible).value()[0]));
}

TEST(Orbit, WithoutExtentItNeedsADistance) {
    Gaussians scene;
    OrbitOptions options;
    for (const float logit : {kOpaque, kFaint, kFaint}) {  // nothing, one, still one that is seen
        EXPECT_ERROR(orbit(scene, options), Code::kInvalidArgument, "no visible extent");
        options.distance = 4;
        EXPECT_OK(orbit(scene, options));
        options.distance = 0;
        add(scene, {0.5 * static_cast<double>(scene.count()), 0, 0}, logit);
    }
}

}  // namespace
}  // namespace splat::scene

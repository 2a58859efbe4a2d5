#include "synthetic/ray_caster.h"

#include <gtest/gtest.h>

#include <set>

#include "io/maps/map_images.h"
#include "scene/camera_pose.h"
#include "synthetic/object_writer.h"

namespace splat::synthetic {
namespace {

scene::Camera camera_at(const Vec3& eye, std::uint32_t size) {
    scene::Camera camera;
    camera.width = camera.height = size;
    camera.fx = camera.fy = 131.25 * size / 128;
    camera.cx = camera.cy = size / 2.0;
    camera.world_to_camera = scene::look_at(eye, {0, 0, 0}, {0, 0, 1}).value();
    return camera;
}

Solids ball() {
    Solid solid = make_ellipsoid({0, 0, 0}, {0.4, 0.4, 0.4}, {0.2, 0.4, 0.8});
    find_hull(solid);
    return {solid};
}

/// All of the image against a ball's closed form.
TEST(RayCaster, DepthAndNormalsOfABallAreExact) {
    const scene::Camera camera = camera_at({1.3, 0, 0}, 48);
    const Picture picture = cast(ball(), camera);
    int hits = 0;
    for (std::uint32_t y = 0; y < 48; ++y)
        for (std::uint32_t x = 0; x < 48; ++x) {
            const Vec3 d = {(x + 0.5 - camera.cx) / camera.fx, (y + 0.5 - camera.cy) / camera.fy,
                            1};
            const double a = glm::dot(d, d);
            const double b = -1.3;  // d . (eye - center) with the centre 1.3 ahead
            const double discriminant = b * b - a * (1.3 * 1.3 - 0.16);
            const std::size_t i = y * 48 + x;
            if (discriminant < 0) {
                EXPECT_EQ(picture.depth[i], 0);
                continue;
            }
            ++hits;
            const double t = (-b - std::sqrt(discriminant)) / a;
            EXPECT_NEAR(picture.depth[i], t, 1e-6);
            const Vec3 normal = {t * d[0] / 0.4, t * d[1] / 0.4, (t - 1.3) / 0.4};
            for (std::size_t k = 0; k < 3; ++k)
                EXPECT_NEAR(picture.normals[i * 3 + k], normal[k], 1e-6);
        }
    EXPECT_GT(hits, 400);
}

TEST(RayCaster, NearerSolidsHideFartherOnes) {
    Solids solids = {make_box({0.1, -0.2, -0.2}, {0.2, 0.2, 0.2}, {1, 0, 0}),
                     make_box({-0.4, -0.3, -0.3}, {-0.1, 0.3, 0.3}, {0, 1, 0})};
    for (Solid& solid : solids) find_hull(solid);
    const Picture front = cast(solids, camera_at({1.3, 0, 0}, 32));
    const Picture back = cast(solids, camera_at({-1.3, 0, 0}, 32));
    const std::size_t middle = (16 * 32 + 16) * 3;
    EXPECT_GT(front.rgb[middle], 0.4F);
    EXPECT_EQ(front.rgb[middle + 1], 0);
    EXPECT_GT(back.rgb[middle + 1], 0.4F);
    EXPECT_EQ(back.rgb[middle], 0);
    EXPECT_NEAR(front.depth[middle / 3], 1.1, 1e-6);
    EXPECT_NEAR(back.depth[middle / 3], 0.9, 1e-6);
}

/// Windows around solids only save time: the image is that of solids without them.
TEST(RayCaster, WindowsLeaveNothingOut) {
    for (std::uint32_t object = 0; object < 4; ++object) {
        Random random(3, 0, object, 0);
        const Solids solids = fitted(object % 2 == 0 ? make_car(random) : make_chair(random));
        Solids everywhere = solids;
        for (Solid& solid : everywhere)
            solid.hull = {{100, 0, 0}, {-100, 0, 0}};  // behind the camera
        const scene::Camera camera = camera_at({0.6, -0.9, 0.7}, 40);
        const Picture a = cast(solids, camera);
        const Picture b = cast(everywhere, camera);
        EXPECT_EQ(a.rgb, b.rgb);
        EXPECT_EQ(a.depth, b.depth);
        EXPECT_EQ(a.normals, b.normals);
    }
}

TEST(RayCaster, EdgesAreSmoothAndFacesEven) {
    Solids solids = {make_box({-0.2, -0.21, -0.21}, {0.2, 0.21, 0.21}, {0, 0, 0})};
    find_hull(solids[0]);
    const Picture picture = cast(solids, camera_at({1.3, 0, 0}, 64));
    std::set<float> values;
    for (std::size_t x = 0; x < 64; ++x) values.insert(picture.rgb[(32 * 64 + x) * 3]);
    EXPECT_EQ(*values.begin(), 0);
    EXPECT_EQ(*values.rbegin(), 1);
    EXPECT_EQ(values.size(), 3U) << "black, white, and a mixture at both edges";
}

TEST(RayCaster, MapsAreQuantisedAsTheReferenceDoes) {
    const Picture picture{2, 1, {}, {0.8F, 0}, {0, 0, -1, 0, 0, 0}};
    EXPECT_EQ(io::depth_image(picture.depth, 2, 1, 1.8).samples,
              (std::vector<std::uint16_t>{254, 0}))
        << "255 / (1 + 1e-8 / (1 / 0.8 - 1 / 1.8)), truncated";
    EXPECT_EQ(io::normal_image(picture.normals, 2, 1).samples,
              (std::vector<std::uint16_t>{127, 127, 0, 127, 127, 127}));
    EXPECT_EQ(mask_image(picture).samples, (std::vector<std::uint16_t>{255, 0}));
    EXPECT_EQ(io::depth_image(std::vector<float>{1, 1}, 2, 1, 1.8).samples,
              (std::vector<std::uint16_t>{0, 0}));
}

}  // namespace
}  // namespace splat::synthetic

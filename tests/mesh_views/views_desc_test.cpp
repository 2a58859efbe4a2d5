#include "mesh_views/views_desc.h"

#include <gtest/gtest.h>

#include "mesh_views/sample_views.h"
#include "scene/camera_pose.h"
#include "support/expect_status.h"
#include "synthetic/object_writer.h"

namespace splat::mesh_views {
namespace {

using scene::Vec3;

/// Where a point of the world is in an image, and its depth.
Vec3 seen(const scene::Camera& camera, const Vec3& point) {
    const Vec3 at = scene::rotation_of(camera.world_to_camera) * point +
                    scene::translation_of(camera.world_to_camera);
    return {camera.cx + camera.fx * at.x / at.z, camera.cy + camera.fy * at.y / at.z, at.z};
}

TEST(ViewsDesc, CamerasHaveTheLensAndTheTestsOfSrn) {
    ViewsDesc desc = test::sample_views("x");
    desc.split = "test";
    desc.test_views = 251;
    synthetic::WriterDesc srn;
    srn.resolution = 16;
    for (const std::uint32_t view : {0U, 64U, 250U}) {
        const scene::Camera own = view_camera(desc, view);
        const scene::Camera other = view_camera(srn, synthetic::Split::kTest, 0, view);
        EXPECT_EQ(own.fx, other.fx);
        for (std::size_t i = 0; i < 16; ++i)
            EXPECT_NEAR(own.world_to_camera[i], other.world_to_camera[i], 1e-12) << view;
    }
}

TEST(ViewsDesc, ProtocolsPlaceTheirCameras) {
    ViewsDesc desc = test::sample_views("x");
    desc.train_views = 200;
    double least = 9, most = -9;
    for (std::uint32_t view = 0; view < 200; ++view) {
        const Vec3 eye = scene::camera_center(view_camera(desc, view));
        EXPECT_NEAR(glm::length(eye), 1.3, 1e-12);
        least = std::min(least, eye.z);
        most = std::max(most, eye.z);
    }
    EXPECT_LT(least, -1.2);
    EXPECT_GT(most, 1.2);
    desc.protocol = Protocol::kHemisphere;
    for (std::uint32_t view = 0; view < 200; ++view)
        EXPECT_GE(scene::camera_center(view_camera(desc, view)).z, 0);
    desc.protocol = Protocol::kOrbit;
    desc.train_views = 4;
    desc.distance = 2;
    desc.elevation = 30 * kDegree;
    for (std::uint32_t view = 0; view < 4; ++view) {
        const Vec3 eye = scene::camera_center(view_camera(desc, view));
        EXPECT_NEAR(eye.z, 1, 1e-12);
        EXPECT_NEAR(eye[view % 2], (view < 2 ? 1 : -1) * std::sqrt(3.0), 1e-12) << view;
    }
}

TEST(ViewsDesc, NamesAndSeedsDecideTheViews) {
    const ViewsDesc desc = test::sample_views("x");
    ViewsDesc renamed = desc, seeded = desc, again = desc;
    renamed.name = "other";
    seeded.seed = 1;
    again.train_views = 100;
    EXPECT_EQ(view_camera(desc, 1).world_to_camera, view_camera(again, 1).world_to_camera);
    for (const ViewsDesc& other : {renamed, seeded})
        EXPECT_NE(view_camera(desc, 1).world_to_camera, view_camera(other, 1).world_to_camera);
    EXPECT_NE(view_camera(desc, 1).world_to_camera, view_camera(desc, 2).world_to_camera);
}

TEST(ViewsDesc, JitterStaysInItsRange) {
    ViewsDesc desc = test::sample_views("x");
    const ViewsDesc still = desc;
    desc.jitter = 2 * kDegree;
    double least = 9, most = 0, farthest = 0;
    for (std::uint32_t view = 0; view < 300; ++view) {
        const scene::Camera camera = view_camera(desc, view);
        ASSERT_OK(scene::check_camera(camera));
        const Vec3 eye = scene::camera_center(camera);
        least = std::min(least, glm::length(eye));
        most = std::max(most, glm::length(eye));
        const Vec3 origin = seen(camera, {0, 0, 0});
        const double across = (origin.x - 8) / camera.fx, down = (origin.y - 8) / camera.fy;
        farthest = std::max(farthest, std::hypot(across, down));
        const Vec3 place = scene::camera_center(view_camera(still, view));
        EXPECT_NEAR(glm::length(eye / glm::length(eye) - place / glm::length(place)), 0, 1e-12);
    }
    EXPECT_GE(least, 1.3 * 0.98);
    EXPECT_LE(most, 1.3 * 1.02);
    EXPECT_GT(most - least, 1.3 * 0.035);
    EXPECT_LE(farthest, std::tan(3 * kDegree)) << "at most 2 degrees in both directions";
    EXPECT_GT(farthest, std::tan(2.2 * kDegree));
}

TEST(ViewsDesc, MeshesWithYUpAreTurned) {
    const ViewsDesc desc = test::sample_views("x");
    const scene::Camera camera = view_camera(desc, 0);
    const scene::Camera own = in_mesh_axes(camera, Up::kY);
    ASSERT_OK(scene::check_camera(own));
    EXPECT_EQ(in_world({0, 1, 0}, Up::kY), Vec3(0, 0, 1)) << "y is up";
    EXPECT_EQ(in_world({0, 0, 1}, Up::kY), Vec3(1, 0, 0)) << "glTF's front";
    EXPECT_EQ(in_world({1, 2, 3}, Up::kZ), Vec3(1, 2, 3));
    for (const Vec3& point : {Vec3(0.1, 0.2, 0.3), Vec3(-0.3, 0.1, 0)}) {
        const Vec3 of_mesh = seen(own, point), of_world = seen(camera, in_world(point, Up::kY));
        for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(of_mesh[k], of_world[k], 1e-12);
    }
}

TEST(ViewsDesc, FieldsOutOfTheirRangesAreRefused) {
    const auto refused = [](auto change, Code code, const char* part) {
        ViewsDesc desc = test::sample_views("x");
        change(desc);
        EXPECT_ERROR(check_desc(desc), code, part);
    };
    EXPECT_OK(check_desc(test::sample_views("x")));
    constexpr Code kInvalid = Code::kInvalidArgument;
    refused([](ViewsDesc& d) { d.path = ""; }, kInvalid, "path");
    refused([](ViewsDesc& d) { d.name = "a/b"; }, kInvalid, "'a%2Fb'");
    refused([](ViewsDesc& d) { d.name = ""; }, kInvalid, "name is ''");
    refused([](ViewsDesc& d) { d.category = ".."; }, kInvalid, "category is '..'");
    refused([](ViewsDesc& d) { d.prepared.assign(1001, 'x'); }, kInvalid, "1001 bytes");
    refused([](ViewsDesc& d) { d.split = "all"; }, kInvalid, "'all'");
    refused([](ViewsDesc& d) { d.size = 7; }, kInvalid, "size is 7");
    refused([](ViewsDesc& d) { d.size = 2049; }, Code::kUnsupported, "2049");
    refused([](ViewsDesc& d) { d.train_views = 0; }, kInvalid, "0 views");
    refused([](ViewsDesc& d) { d.test_views = 100001; }, kInvalid, "100001 views");
    refused([](ViewsDesc& d) { d.samples = 3; }, kInvalid, "samples is 3");
    refused([](ViewsDesc& d) { d.points = 10000001; }, kInvalid, "10000001 points");
    refused([](ViewsDesc& d) { d.distance = 0; }, kInvalid, "distance is 0");
    refused([](ViewsDesc& d) { d.fov_x = 4; }, kInvalid, "fov_x is 4");
    refused([](ViewsDesc& d) { d.elevation = std::nan(""); }, kInvalid, "elevation is nan");
    refused([](ViewsDesc& d) { d.jitter = -1; }, kInvalid, "jitter is -1");
    refused([](ViewsDesc& d) { d.exposure = 9; }, kInvalid, "exposure is 9");
}

}  // namespace
}  // namespace splat::mesh_views

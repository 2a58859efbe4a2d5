// Points of meshes, depth maps and scenes through the C API. Needs no device.
#include <cmath>
#include <fstream>

#include "api/raster_calls.h"

namespace splat::test {
namespace {

/// A file of a mesh.
class MeshFile {
  public:
    explicit MeshFile(const std::string& text) { std::ofstream(path_.path()) << text; }
    [[nodiscard]] const char* path() const { return path_.c_str(); }

  private:
    const Temporary path_{".obj"};
};

constexpr const char* kSquare = "v 0 0 2\nv 1 0 2\nv 1 1 2\nv 0 1 2\nf 1 2 3 -1\n";

TEST(ApiPoints, OfAMesh) {
    const MeshFile file(kSquare);
    Floats points(3000), first(30);
    ASSERT_DONE(splat_points_from_mesh(file.path(), 5, points.data(), points.size()));
    ASSERT_DONE(splat_points_from_mesh(file.path(), 5, first.data(), first.size()));
    EXPECT_TRUE(std::equal(first.begin(), first.end(), points.begin()));
    double sum = 0;
    for (std::size_t i = 0; i < points.size(); i += 3) {
        ASSERT_GE(points[i], 0);
        ASSERT_LE(points[i], 1);
        ASSERT_EQ(points[i + 2], 2);
        sum += static_cast<double>(points[i]);
    }
    EXPECT_NEAR(sum / 1000, 0.5, 4 * std::sqrt(1.0 / 12 / 1000));
    EXPECT_DONE(splat_points_from_mesh(file.path(), 5, points.data(), 0));
}

TEST(ApiPoints, OfAMeshOfGltf) {
    // One triangle at z = 2, which its node moves to z = 5.
    const MeshFile file(
        R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,)"
        R"("translation":[0,0,3]}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],)"
        R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],)"
        R"("bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,"uri":)"
        R"("data:;base64,AAAAAAAAAAAAAABAAACAPwAAAAAAAABAAAAAAAAAgD8AAABA"}]})");
    Floats points(300);
    ASSERT_DONE(splat_points_from_mesh(file.path(), 5, points.data(), points.size()));
    for (std::size_t i = 0; i < points.size(); i += 3) {
        EXPECT_LE(points[i] + points[i + 1], 1.0001F);
        EXPECT_EQ(points[i + 2], 5);
    }
}

TEST(ApiPoints, OfACloudAreSpreadEvenly) {
    const std::string head =
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
        "property float z\n";
    const std::string rows = "0 0 1\n1 0 1\n2 0 1\n3 0 1\n";
    {
        const MeshFile file(head + "end_header\n" + rows);
        Floats all(12), some(6);
        ASSERT_DONE(splat_points_from_mesh(file.path(), 0, all.data(), all.size()));
        ASSERT_DONE(splat_points_from_mesh(file.path(), 0, some.data(), some.size()));
        EXPECT_EQ(all, (Floats{0, 0, 1, 1, 0, 1, 2, 0, 1, 3, 0, 1}));
        EXPECT_EQ(some, (Floats{0, 0, 1, 2, 0, 1}));
    }
    Floats points(3);
    const MeshFile mesh(head +
                        "element face 1\nproperty list uchar int vertex_index\nend_header\n" +
                        rows + "3 0 1 2\n");
    EXPECT_REFUSED(splat_points_from_mesh(mesh.path(), 0, points.data(), 3), kUnsupported,
                   "a mesh of 1 faces, expected points alone");
}

TEST(ApiPoints, OfADamagedMesh) {
    Floats points(3, 7);
    const MeshFile file(std::string(kSquare) + "f 1 2 9\n");
    EXPECT_REFUSED(splat_points_from_mesh(file.path(), 0, points.data(), 3), kFormat,
                   "line 6: the face names vertex 9");
    EXPECT_TRUE(holds(splat_last_error_message(), file.path()));
    EXPECT_EQ(points, Floats(3, 7));
}

TEST(ApiPoints, OfADepthMap) {
    splat_camera camera{};
    camera.width = 2;
    camera.height = 1;
    camera.fx = camera.fy = 2;
    camera.cx = 1;
    camera.cy = 0.5;
    for (const std::size_t i : {0U, 5U, 10U, 15U}) camera.world_to_camera[i] = 1;
    camera.world_to_camera[11] = 3;  // the camera stands at z = -3
    Floats depth = {4, 0};
    const splat_image image = packed_image(depth, 2, 1, 1);
    Floats points(6, 7);
    std::uint64_t needed = 0;
    EXPECT_EQ(splat_points_from_depth(&image, &camera, points.data(), 2, &needed),
              SPLAT_INCOMPLETE);
    EXPECT_EQ(needed, 3U);
    EXPECT_EQ(points[0], 7);
    ASSERT_DONE(splat_points_from_depth(&image, &camera, points.data(), 6, &needed));
    EXPECT_EQ(points, (Floats{-1, 0, 1, 7, 7, 7}));
    depth[0] = -1;
    EXPECT_DONE(splat_points_from_depth(&image, &camera, nullptr, 0, &needed));
    EXPECT_EQ(needed, 0U);
}

TEST(ApiPoints, ASceneAgainstItsOwnMeansIsPerfect) {
    const SampleScene sample(50);
    const Scene scene = sample.create();
    const auto scores =
        got(splat_scene_compare_points, scene, 0, sample.means.data(), sample.means.size(), 1e-6);
    EXPECT_EQ(scores.gaussians, 50U);
    EXPECT_EQ(scores.chamfer, 0);
    EXPECT_EQ(scores.f_score, 1);
}

TEST(ApiPoints, OnlyOpaqueGaussiansCount) {
    const float means[] = {0, 0, 0, 1, 0, 0}, logits[] = {5, -5}, truth[] = {0, 2, 0};
    auto desc = sized<splat_scene_desc>();
    desc.count = 2;
    desc.means = means;
    desc.opacity_logits = logits;
    const Scene scene = got(splat_scene_create, &desc);
    auto all = sized<splat_point_scores>(), opaque = all;
    ASSERT_DONE(splat_scene_compare_points(scene, 0, truth, 3, 2.1, &all));
    ASSERT_DONE(splat_scene_compare_points(scene, 0.5, truth, 3, 2.1, &opaque));
    EXPECT_EQ(all.gaussians, 2U);
    EXPECT_NEAR(all.accuracy, (2 + std::sqrt(5.0)) / 2, 1e-15);
    EXPECT_EQ(all.completeness, 2);
    EXPECT_EQ(all.precision, 0.5);
    EXPECT_EQ(all.recall, 1);
    EXPECT_EQ(opaque.gaussians, 1U);
    EXPECT_EQ(opaque.accuracy, 2);
    EXPECT_EQ(opaque.chamfer, 2);
    EXPECT_EQ(opaque.chamfer_squared, 8);
    EXPECT_EQ(opaque.f_score, 1);
}

}  // namespace
}  // namespace splat::test

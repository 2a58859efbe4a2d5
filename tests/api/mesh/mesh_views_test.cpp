// Meshes as objects of a data set, through the C API.
#include <cmath>
#include <filesystem>

#include "api/api_calls.h"

namespace splat::test {
namespace {

/// The cube of side 0.5 around the origin.
Mesh make_cube() {
    static const std::vector<double> vertices = [] {
        std::vector<double> made;
        for (const double z : {-0.25, 0.25})
            for (const double y : {-0.25, 0.25})
                for (const double x : {-0.25, 0.25}) made.insert(made.end(), {x, y, z});
        return made;
    }();
    static const std::vector<std::uint32_t> triangles = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6,
                                                         0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3,
                                                         0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
    auto desc = sized<splat_mesh_desc>();
    desc.vertices = vertices.data();
    desc.vertex_count = vertices.size();
    desc.triangles = triangles.data();
    desc.triangle_count = triangles.size();
    return got(splat_mesh_create, &desc);
}

/// Two views of 32 x 32 pixels, on an orbit.
splat_mesh_views_desc views_desc(const char* path) {
    auto desc = sized<splat_mesh_views_desc>();
    desc.flags = SPLAT_MESH_VIEWS_DEPTH | SPLAT_MESH_VIEWS_NORMAL | SPLAT_MESH_VIEWS_MASK;
    desc.path = path;
    desc.name = "cube";
    desc.size = 32;
    desc.train_views = 2;
    desc.points = 100;
    desc.protocol = SPLAT_MESH_PROTOCOL_ORBIT;
    desc.background = SPLAT_MESH_BACKGROUND_BLACK;
    return desc;
}

std::int32_t is_there(const splat_mesh_views_desc& desc) {
    std::int32_t found = -1;
    EXPECT_DONE(splat_mesh_find_views(&desc, &found));
    return found;
}

class ApiMeshViews : public testing::Test {
  protected:
    void write() { ASSERT_DONE(splat_mesh_write_views(mesh_, shared_device(), &desc_)); }

    Temporary folder_;
    const Mesh mesh_ = make_cube();
    splat_mesh_views_desc desc_ = views_desc(folder_.c_str());
};

TEST_F(ApiMeshViews, AreADataSetThatShowsTheMesh) {
    EXPECT_EQ(is_there(desc_), 0);
    EXPECT_FALSE(std::filesystem::exists(folder_.path())) << "a question writes nothing";
    write();
    EXPECT_EQ(is_there(desc_), 1);
    auto data = sized<splat_dataset_desc>();
    data.path = folder_.c_str();
    data.flags = SPLAT_DATA_DEPTH | SPLAT_DATA_NORMAL | SPLAT_DATA_MASK;
    Dataset dataset;
    ASSERT_DONE(splat_dataset_open(&data, dataset.out()));
    constexpr std::size_t kArea = 32 * 32, kMiddle = 16 * 32 + 16;
    Floats images(3 * kArea), depths(kArea), normals(3 * kArea), masks(kArea);
    auto out = sized<splat_dataset_views>();
    out.images = images.data();
    out.depths = depths.data();
    out.normals = normals.data();
    out.masks = masks.data();
    const std::uint32_t view = 0;
    ASSERT_DONE(splat_dataset_read(dataset, 0, &view, 1, &out));
    EXPECT_EQ(masks[0], 0);
    EXPECT_EQ(masks[kMiddle], 1);
    EXPECT_EQ(images[0], 0) << "black";
    EXPECT_GT(images[kMiddle], 0.3F);
    EXPECT_NEAR(depths[kMiddle], 1, 0.01);
    EXPECT_EQ(depths[0], 0);
    EXPECT_NEAR(normals[kMiddle], 0.5, 0.01);
    EXPECT_NEAR(normals[kArea + kMiddle], 0.5, 0.01);
    EXPECT_NEAR(normals[2 * kArea + kMiddle], 0, 0.01) << "towards the camera";
    EXPECT_NEAR(normals[0], 0.5, 0.01);
    // The face of side 0.5 is 131.25 / 4 x 0.5 / 1.05 = 15.625 pixels wide: 62 of its 62.5 samples are in it.
    float covered = 0;
    for (const float mask : masks) covered += mask;
    EXPECT_NEAR(covered, 62 * 62 / 16.0, 0.25) << "but for masks of 8 bits";
}

TEST_F(ApiMeshViews, HavePointsOnTheSurface) {
    desc_.flags = SPLAT_MESH_VIEWS_Y_UP;
    write();
    const std::string object = folder_.path() + "/srn_objects/objects_train/cube";
    EXPECT_FALSE(std::filesystem::exists(object + "/mask"));
    Floats points(300);
    ASSERT_DONE(splat_points_from_mesh((object + "/points.ply").c_str(), 0, points.data(), 300));
    for (std::size_t i = 0; i < 300; i += 3) {
        float farthest = 0;
        for (std::size_t k = 0; k < 3; ++k) farthest = std::max(farthest, std::abs(points[i + k]));
        EXPECT_EQ(farthest, 0.25F);
    }
}

TEST_F(ApiMeshViews, AreKeptAndSayWhatIsWrong) {
    write();
    const std::string path = folder_.path() + "/srn_objects/objects_train/cube/rgb/000001.png";
    const std::string before = file_bytes(path);
    write();
    EXPECT_EQ(file_bytes(path), before);
    const auto refused_with = [&](auto change, splat_result code, const char* part) {
        splat_mesh_views_desc desc = desc_;
        change(desc);
        std::int32_t found = -1;
        EXPECT_REFUSED(splat_mesh_find_views(&desc, &found), code, part);
        EXPECT_EQ(found, -1);
        EXPECT_REFUSED(splat_mesh_write_views(mesh_, shared_device(), &desc), code, part);
    };
    refused_with([](auto& d) { d.size = 16; }, kArgument, "data made with other values");
    refused_with([](auto& d) { d.split = "val"; }, kArgument, "in the split train of");
    refused_with([](auto& d) { d.split = "all"; }, kArgument, "'all'");
    refused_with([](auto& d) { d.layout = "tables"; }, kArgument, "expected srn or images");
    refused_with([](auto& d) { d.protocol = 3; }, kArgument, "protocol is 3, expected 0 to 2");
    refused_with([](auto& d) { d.background = -1; }, kArgument, "background is -1");
    refused_with([](auto& d) { d.samples = 3; }, kArgument, "samples is 3");
    refused_with([](auto& d) { d.flags = 32; }, kArgument, "flags");
    refused_with([](auto& d) { d.reserved = 1; }, kArgument, "reserved");
    refused_with([](auto& d) { d.name = nullptr; }, kArgument, "name");
    refused_with([](auto& d) { d.name = "a/b"; }, kArgument, "'a/b'");
    refused_with([](auto& d) { d.size = 4096; }, kUnsupported, "4096");
}

TEST_F(ApiMeshViews, OfWhatNoViewShowsAndNowhereAreRefused) {
    desc_.distance = 1e5;
    EXPECT_REFUSED(splat_mesh_write_views(mesh_, shared_device(), &desc_), kFormat,
                   "in none of its 2 views");
    EXPECT_EQ(is_there(desc_), 0);
    desc_.path = "/proc/none";
    EXPECT_REFUSED(splat_mesh_write_views(mesh_, shared_device(), &desc_), kNotFound, "/proc/none");
}

}  // namespace
}  // namespace splat::test

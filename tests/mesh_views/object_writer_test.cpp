#include "mesh_views/object_writer.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "data/dataset.h"
#include "data/dataset_check.h"
#include "io/file.h"
#include "io/mesh/mesh.h"
#include "mesh_views/sample_views.h"
#include "support/expect_status.h"
#include "synthetic/sample_folder.h"

namespace splat::mesh_views {
namespace {

namespace fs = std::filesystem;
using test::sample_views;
using test::SampleFolder;

Status write(const ViewsDesc& desc) {
    return write_object(desc, test::sample_square(), test::sample_draw(desc.size));
}

std::map<std::string, std::string> contents(const fs::path& folder) {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
        if (entry.is_regular_file())
            files[entry.path().lexically_relative(folder).generic_string()] =
                test::file_text(entry.path());
    return files;
}

io::Image picture(const fs::path& path) {
    return need(io::read_png(need(io::read_file(path.string()))));
}

/// The data set of a folder opens and has no problem.
void expect_clean(const fs::path& path, const char* format, const std::string& split) {
    data::DatasetDesc desc;
    desc.path = path.string();
    desc.split = split;
    const auto dataset = need(data::Dataset::open(desc));
    EXPECT_EQ(dataset->index().format, format);
    const data::ObjectCheck check = need(data::check_object(*dataset, 0));
    EXPECT_TRUE(check.problems.empty()) << check.problems.front();
    EXPECT_EQ(dataset->index().maps, data::flag_of(data::MapKind::kDepth) |
                                         data::flag_of(data::MapKind::kNormal) |
                                         data::flag_of(data::MapKind::kMask));
    EXPECT_TRUE(dataset->index().unread.empty());
}

TEST(MeshViewsWriter, SrnIsReadAsWritten) {
    const SampleFolder folder;
    ViewsDesc desc = sample_views(folder.path());
    ASSERT_OK(write(desc));
    desc.split = "val";
    desc.name = "other";
    ASSERT_OK(write(desc));
    const auto files = contents(folder.path());
    EXPECT_EQ(files.size(), 1 + (2 + 3 * 5U) + (2 + 4 * 5U));
    EXPECT_EQ(files.count("srn_objects/objects_val/other/normal/000003.png"), 1U);
    EXPECT_EQ(files.at("srn_objects/objects_train/block/intrinsics.txt"),
              "16.40625 8 8 0\n0 0 0\n1\n16 16\n");
    expect_clean(folder.path(), "srn", "train");
    expect_clean(folder.path(), "srn", "val");
}

TEST(MeshViewsWriter, ImagesAreReadAsWritten) {
    const SampleFolder folder;
    ViewsDesc desc = sample_views(folder.path());
    desc.layout = Layout::kImages;
    ASSERT_OK(write(desc));
    const auto files = contents(folder.path());
    EXPECT_EQ(files.size(), 1 + (2 + 3 * 4U));
    EXPECT_EQ(files.count("train/block/transforms.json"), 1U);
    expect_clean(folder.path(), "images", "train");
}

TEST(MeshViewsWriter, PicturesAndMapsAreThoseDrawn) {
    const SampleFolder folder;
    ViewsDesc desc = sample_views(folder.path());
    desc.albedo = true;
    ASSERT_OK(write(desc));
    const fs::path object = folder / "srn_objects/objects_train/block";
    const auto at = [&](const char* kind, std::size_t x, std::size_t y, std::size_t channel = 0) {
        const io::Image image = picture(object / kind / "000001.png");
        return image.samples[(y * image.width + x) * image.channels + channel];
    };
    EXPECT_EQ(at("rgb", 8, 8, 0), 255);
    EXPECT_EQ(at("rgb", 8, 8, 1), 0);
    EXPECT_EQ(at("rgb", 0, 0, 1), 255) << "white";
    EXPECT_EQ(at("albedo", 8, 8, 1), 255);
    EXPECT_EQ(at("mask", 4, 8), 128) << "half covered";
    EXPECT_EQ(at("mask", 8, 8), 255);
    EXPECT_EQ(at("mask", 0, 0), 0);
    EXPECT_EQ(at("normal", 8, 8, 2), 0);
    EXPECT_EQ(at("normal", 8, 8, 0), 127);
    EXPECT_EQ(at("depth", 8, 8), 254);
    EXPECT_EQ(at("depth", 0, 0), 0);
}

TEST(MeshViewsWriter, ExposuresChangePicturesNotAlbedo) {
    const SampleFolder folder;
    ViewsDesc desc = sample_views(folder.path());
    desc.albedo = true;
    desc.exposure = 1;
    const mesh_views::Draw gray = [](std::span<const scene::Camera> cameras) {
        auto drawn = test::sample_draw(16)(cameras);
        for (Drawn& view : drawn.value())
            for (std::vector<float>* values : {&view.color, &view.albedo})
                for (float& value : *values) value *= 0.5F;
        return drawn;
    };
    ASSERT_OK(write_object(desc, test::sample_square(), gray));
    const fs::path object = folder / "srn_objects/objects_train/block";
    std::set<int> pictures, albedos;
    for (const char* view : {"000000.png", "000001.png", "000002.png"}) {
        const std::size_t middle = 3 * (8 * 16 + 8);
        pictures.insert(picture(object / "rgb" / view).samples[middle]);
        albedos.insert(picture(object / "albedo" / view).samples[middle + 1]);
    }
    EXPECT_EQ(albedos, std::set<int>{128});
    EXPECT_EQ(pictures.size(), 3U) << "each view has its own exposure";
}

TEST(MeshViewsWriter, PointsLieOnTheSurfaceInTheWorld) {
    const SampleFolder folder;
    ViewsDesc desc = sample_views(folder.path());
    desc.up = Up::kY;
    ASSERT_OK(write(desc));
    const auto points = need(io::read_ply_points(
        need(io::read_file((folder / "srn_objects/objects_train/block/points.ply").string()))));
    ASSERT_EQ(points.size(), 20U);
    for (const scene::Vec3& point : points) {
        EXPECT_EQ(point.z, 0) << "the mesh's y, which is up";
        EXPECT_LE(std::abs(point.x), 0.25);
        EXPECT_LE(std::abs(point.y), 0.25);
    }
}

TEST(MeshViewsWriter, SameValuesSameBytes) {
    const SampleFolder one, other;
    ViewsDesc desc = sample_views(one.path());
    desc.background = Background::kGradient;
    desc.exposure = 1;
    desc.jitter = kDegree;
    ASSERT_OK(write(desc));
    desc.path = other.path().string();
    ASSERT_OK(write(desc));
    EXPECT_EQ(contents(one.path()), contents(other.path()));
}

TEST(MeshViewsWriter, ObjectsAppearWholeOrNotAtAllAndAreKept) {
    const SampleFolder folder;
    ViewsDesc desc = sample_views(folder.path());
    desc.train_views = 20;
    std::size_t drawn = 0;
    const mesh_views::Draw breaks = [&](std::span<const scene::Camera> cameras) {
        drawn += cameras.size();
        return drawn > 16 ? Result<std::vector<Drawn>>(damaged("no more"))
                          : test::sample_draw(16)(cameras);
    };
    EXPECT_ERROR(write_object(desc, test::sample_square(), breaks), Code::kFormat, "no more");
    EXPECT_EQ(drawn, 20U) << "views are drawn 16 at a time";
    const fs::path split = folder / "srn_objects/objects_train";
    EXPECT_TRUE(fs::is_empty(split));
    EXPECT_FALSE(need(has_object(desc)));
    ASSERT_OK(write(desc));
    EXPECT_TRUE(need(has_object(desc)));
    EXPECT_OK(write_object(desc, test::sample_square(), breaks)) << "it is not drawn again";
}

TEST(MeshViewsWriter, OtherValuesAndOtherSplitsAreRefused) {
    const SampleFolder folder;
    const ViewsDesc desc = sample_views(folder.path());
    ASSERT_OK(write(desc));
    ViewsDesc other = desc;
    other.background = Background::kBlack;
    EXPECT_ERROR(write(other), Code::kInvalidArgument, "\"background\": \"white\"");
    EXPECT_ERROR(has_object(other), Code::kInvalidArgument, "\"background\": \"black\"");
    other = desc;
    other.prepared = "unit_cube";
    EXPECT_ERROR(write(other), Code::kInvalidArgument, "unit_cube");
    other = desc;
    other.split = "test";
    EXPECT_ERROR(write(other), Code::kInvalidArgument, "is in the split train of");
}

TEST(MeshViewsWriter, WhatShowsNothingIsRefused) {
    const SampleFolder folder;
    const ViewsDesc desc = sample_views(folder.path());
    const mesh_views::Draw nothing = [](std::span<const scene::Camera> cameras) {
        auto drawn = test::sample_draw(16)(cameras);
        for (Drawn& view : drawn.value()) view.alpha.assign(view.alpha.size(), 0);
        return drawn;
    };
    EXPECT_ERROR(write_object(desc, test::sample_square(), nothing), Code::kFormat,
                 "none of its 3 views");
    scene::TriangleMesh flat = test::sample_square();
    flat.vertices.assign(4, {0, 0, 0});
    EXPECT_ERROR(write_object(desc, flat, test::sample_draw(16)), Code::kFormat,
                 "'block' has no surface: each of its 2 triangles");
    EXPECT_TRUE(fs::is_empty(folder / "srn_objects/objects_train"));
}

}  // namespace
}  // namespace splat::mesh_views

// Data sets through the C API. Needs no device.
#include <nlohmann/json.hpp>
#include <thread>

#include "api/api_calls.h"

namespace splat::test {
namespace {

/// All arrays of two views, with a value after each that must stay unchanged.
struct Arrays {
    Floats images = Floats(2 * 3 * 64 + 1, -1);
    Floats depths = Floats(2 * 64 + 1, -1);
    Floats normals = Floats(2 * 3 * 64 + 1, -1);
    Floats masks = Floats(2 * 64 + 1, -1);
    Floats poses = Floats(2 * 16 + 1, -9);
    Floats quaternions = Floats(2 * 4 + 1, -9);
    Floats focals = Floats(2 * 2 + 1, -1);
    Floats distances = Floats(2 + 1, -1);

    splat_dataset_views views() {
        auto out = sized<splat_dataset_views>();
        out.images = images.data();
        out.depths = depths.data();
        out.normals = normals.data();
        out.masks = masks.data();
        out.view_to_world = poses.data();
        out.quaternions = quaternions.data();
        out.focals = focals.data();
        out.origin_distances = distances.data();
        return out;
    }
};

TEST(ApiDataset, GivesAllArraysOfViews) {
    const Dataset dataset = make_dataset();
    Arrays arrays;
    splat_dataset_views out = arrays.views();
    const std::uint32_t views[] = {2, 0};
    ASSERT_DONE(splat_dataset_read(dataset, 1, views, 2, &out));
    for (const Floats* values : {&arrays.images, &arrays.depths, &arrays.normals, &arrays.masks}) {
        EXPECT_EQ(values->back(), -1) << "beyond the end";
        for (std::size_t i = 0; i + 1 < values->size(); ++i) {
            EXPECT_GE((*values)[i], 0);
            EXPECT_LE((*values)[i], 1);
        }
    }
    EXPECT_EQ(arrays.poses.back() + arrays.quaternions.back(), -18);
    EXPECT_EQ(arrays.focals, (Floats{131.25F / 16, 131.25F / 16, 131.25F / 16, 131.25F / 16, -1}));
    EXPECT_EQ(arrays.distances, (Floats{0, 0, -1}));
    for (std::size_t i = 0; i < 16; ++i) EXPECT_EQ(arrays.poses[i], i % 5 == 0 ? 1 : 0);
    EXPECT_NE(arrays.quaternions[4], 1);
    Arrays again;
    splat_dataset_views few = sized<splat_dataset_views>();
    few.masks = again.masks.data();
    ASSERT_DONE(splat_dataset_read(dataset, 1, views, 2, &few));
    EXPECT_EQ(again.masks, arrays.masks);
    EXPECT_EQ(again.images.front(), -1);
}

/// A struct of the first version has no planes.
TEST(ApiDataset, GivesPlanesToThoseWhoKnowThem) {
    const Temporary folder;
    write_cars_with_planes(folder.path());
    splat_dataset_desc desc = dataset_desc();
    desc.path = folder.c_str();
    desc.flags = SPLAT_DATA_PLANE;
    const Dataset dataset = got(splat_dataset_open, &desc);
    Floats planes(2 * 5 * 64 + 1, -1);
    auto out = sized<splat_dataset_views>();
    out.planes = planes.data();
    out.plane_count = planes.size() - 1;
    const std::uint32_t views[] = {0, 1};
    ASSERT_DONE(splat_dataset_read(dataset, 0, views, 2, &out));
    EXPECT_EQ(planes[0], 7 / 255.0F);
    EXPECT_EQ(planes[3 * 64], 1) << "the distance";
    EXPECT_EQ(planes[4 * 64], 1) << "the smaller of two planes";
    EXPECT_EQ(planes[4 * 64 + 63], 0.5F);
    EXPECT_EQ(planes.back(), -1) << "beyond the end";
    planes.assign(planes.size(), -1);
    out.struct_size = offsetof(splat_dataset_views, planes);
    EXPECT_DONE(splat_dataset_read(dataset, 0, views, 2, &out));
    EXPECT_EQ(planes.front(), -1);
}

TEST(ApiDataset, TellsWhatItHolds) {
    const auto report = nlohmann::json::parse(text_of(splat_dataset_report, make_dataset()));
    EXPECT_EQ(report.at("format"), "srn");
    EXPECT_EQ(report.at("split"), "train");
    EXPECT_EQ(report.at("objects"), 2);
    EXPECT_EQ(report.at("views"), 6);
    EXPECT_EQ(report.at("resolution"), 8);
    EXPECT_EQ(report.at("maps"), (std::vector<std::string>{"depth", "normal", "mask"}));
    EXPECT_EQ(report.at("names"), (std::vector<std::string>{"000000_car", "000001_car"}));
    EXPECT_EQ(report.at("views_of"), (std::vector<int>{3, 3}));
    splat_dataset_desc desc = dataset_desc();
    desc.split = "test";
    desc.format = "srn";
    desc.flags = SPLAT_DATA_DEPTH | SPLAT_DATA_NORMAL | SPLAT_DATA_MASK;
    desc.resolution = 4;
    const Dataset test = got(splat_dataset_open, &desc);
    EXPECT_EQ(nlohmann::json::parse(text_of(splat_dataset_report, test)).at("resolution"), 4);
}

TEST(ApiDataset, ThreadsReadTheSame) {
    const Dataset dataset = make_dataset();
    const std::uint32_t views[] = {0, 1};
    Arrays expected;
    splat_dataset_views out = expected.views();
    ASSERT_DONE(splat_dataset_read(dataset, 0, views, 2, &out));
    const Dataset fresh = make_dataset();
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t)
        threads.emplace_back([&] {
            Arrays arrays;
            splat_dataset_views mine = arrays.views();
            EXPECT_DONE(splat_dataset_read(fresh, 0, views, 2, &mine));
            EXPECT_EQ(arrays.images, expected.images);
            EXPECT_EQ(arrays.poses, expected.poses);
        });
    for (std::thread& thread : threads) thread.join();
}

TEST(ApiDataset, NamesWhatIsMissing) {
    splat_dataset_desc desc = dataset_desc();
    desc.path = "/nonexistent";
    Dataset dataset;
    EXPECT_REFUSED(splat_dataset_open(&desc, dataset.out()), kNotFound, "/nonexistent");
    const Dataset good = make_dataset();
    const std::uint32_t view = 3;
    auto out = sized<splat_dataset_views>();
    EXPECT_REFUSED(splat_dataset_read(good, 0, &view, 1, &out), kArgument,
                   "view is 3, but object 0 ('000000_car') has 3 views");
    EXPECT_DONE(splat_dataset_destroy(nullptr));
}

}  // namespace
}  // namespace splat::test

#include "data/dataset.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <thread>

#include "data/sample_formats.h"
#include "io/file.h"
#include "support/expect_status.h"
#include "synthetic/sample_folder.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;
using namespace test;

/// One view's numbers, of any array.
struct Read {
    std::vector<float> images, depths, normals, masks, poses, quaternions, focals, distances;
    Status status;
};

Read read(Dataset& dataset, std::uint32_t object, const std::vector<std::uint32_t>& views,
          bool maps = false) {
    const std::size_t n = views.size();
    const std::size_t area = n * dataset.resolution() * dataset.resolution();
    Read r;
    r.images.resize(area * 3);
    r.depths.resize(maps ? area : 0);
    r.normals.resize(maps ? area * 3 : 0);
    r.masks.resize(maps ? area : 0);
    r.poses.resize(n * 16);
    r.quaternions.resize(n * 4);
    r.focals.resize(n * 2);
    r.distances.resize(n, 9);
    r.status =
        dataset.read(object, views,
                     {r.images.data(), maps ? r.depths.data() : nullptr,
                      maps ? r.normals.data() : nullptr, maps ? r.masks.data() : nullptr,
                      r.poses.data(), r.quaternions.data(), r.focals.data(), r.distances.data()});
    return r;
}

Status open_status(const fs::path& path, std::uint32_t maps = 0) {
    DatasetDesc desc = data_desc(path);
    desc.maps = maps;
    return Dataset::open(desc).status();
}

TEST(Srn, GivesImagesAndCameras) {
    const SampleFolder folder;
    put_object(folder / "srn_cars/cars_train/b");
    put_object(folder / "srn_cars/cars_train/a");
    put_text(folder / "srn_cars/cars_train/.c.1-0.tmp/intrinsics.txt", "");
    const auto dataset = open_data(folder.path());
    EXPECT_EQ(dataset->index().names, (std::vector<std::string>{"a", "b"}));
    EXPECT_EQ(dataset->index().maps, 0U);
    EXPECT_EQ(dataset->resolution(), 8U);
    const Read r = read(*dataset, 1, {1, 0, 1});
    ASSERT_OK(r.status);
    for (std::size_t v = 0; v < 3; ++v)
        for (std::size_t c = 0; c < 3; ++c)
            for (std::size_t i = 0; i < 64; ++i)
                EXPECT_EQ(r.images[(v * 3 + c) * 64 + i],
                          static_cast<float>(16 * (i / 8) + 4 * (i % 8) + c + (v != 1)) / 255.0F);
    EXPECT_EQ(r.focals, (std::vector<float>{10, 10, 10, 10, 10, 10}));
    EXPECT_EQ(r.distances, (std::vector<float>{0, 0, 0}));
    EXPECT_EQ(r.quaternions[0] * 10 + r.quaternions[8], 11) << "views 0 and 2 are the identity";
    // Camera 1 stands at x = 2 and looks along -x; camera 0 stands at z = -2 and looks along z.
    // Seen from camera 1 it is to the right, because its z axis is camera 1's x axis.
    const std::vector<float> expected = {0, 0, -1, 0, 0, 1, 0, 0, 1, 0, 0, 0, -2, 0, 2, 1};
    EXPECT_EQ(std::vector<float>(r.poses.begin() + 16, r.poses.begin() + 32), expected);
}

TEST(Srn, FindsTheFolderOfTheSplit) {
    const SampleFolder folder;
    const fs::path root = folder.path();
    put_object(root / "srn_chairs/chairs_2.0_train/a");
    put_object(root / "srn_chairs/chairs_test/chairs_2.0_test/b");
    DatasetDesc desc;
    for (const fs::path& path : {root, root / "srn_chairs", root / "srn_chairs/chairs_2.0_train"}) {
        desc.path = path.string();
        ASSERT_NE(open_data(desc), nullptr);
        EXPECT_EQ(open_data(desc)->index().names.front(), "a");
    }
    desc.path = root.string();
    desc.split = "test";
    ASSERT_NE(open_data(desc), nullptr);
    EXPECT_EQ(open_data(desc)->index().names.front(), "b");
    desc.split = "val";
    EXPECT_ERROR(Dataset::open(desc), Code::kNotFound,
                 "folders of splits: chairs_2.0_train, chairs_test");
    put_object(root / "srn_cars/cars_train/a");
    EXPECT_ERROR(open_status(root), Code::kInvalidArgument, "srn_cars, srn_chairs");
    desc.path = root.string();
    desc.split = "train";
    for (const char* category : {"cars", "cars_priors", "chairs"}) {
        desc.category = category;
        ASSERT_NE(open_data(desc), nullptr);
    }
    desc.category = "nmr";
    EXPECT_ERROR(Dataset::open(desc), Code::kInvalidArgument, "give the path of one");
}

TEST(Srn, AFolderWithoutSplitsServesAny) {
    const SampleFolder folder;
    put_object(folder / "a");
    bool lacks = false;
    DatasetDesc desc = data_desc(folder.path());
    for (const char* split : {"train", "test"}) {
        desc.split = split;
        ASSERT_NE(open_data(desc), nullptr);
        EXPECT_FALSE(open_data(desc)->index().has_splits);
    }
    desc.lacks_split = &lacks;
    EXPECT_ERROR(Dataset::open(desc), Code::kNotFound, "has no splits: its objects");
    EXPECT_TRUE(lacks) << "for one who looks for a split of its own";
    fs::create_directory(folder / "cars_train");
    fs::rename(folder / "a", folder / "cars_train/a");
    desc.split = "train";
    ASSERT_NE(open_data(desc), nullptr);
    EXPECT_TRUE(open_data(desc)->index().has_splits);
}

TEST(Srn, TellsAMissingSplitFromADamagedOne) {
    const SampleFolder folder;
    put_object(folder / "cars_train/a");
    DatasetDesc desc = data_desc(folder.path(), "val");
    const auto lacks = [&](Code code = Code::kNotFound) {
        bool told = false;
        desc.lacks_split = &told;
        EXPECT_EQ(Dataset::open(desc).status().code(), code);
        return told;
    };
    EXPECT_TRUE(lacks());
    fs::create_directories(folder / "cars_val");
    EXPECT_FALSE(lacks(Code::kFormat)) << "its objects are missing";
    put_object(folder / "cars_val/a");
    desc.maps = flag_of(MapKind::kDepth);
    EXPECT_FALSE(lacks()) << "its maps are missing";
    EXPECT_ERROR(Dataset::open(desc), Code::kNotFound,
                 "maps requested: depth; every object has: none; missing: '" +
                     (folder / "cars_val/a/depth").generic_string());
}

TEST(Srn, NamesWhatIsWrong) {
    const SampleFolder folder;
    const fs::path object = folder / "cars_train/a";
    const auto wrong = [&](auto change, const char* part, Code code = Code::kFormat) {
        fs::remove_all(object);
        put_object(object);
        change();
        const Status opened = open_status(folder.path());
        if (!opened.ok()) {
            EXPECT_ERROR(opened, code, part);
            return;
        }
        DatasetDesc desc;
        desc.path = folder.path().string();
        auto dataset = need(Dataset::open(desc));
        EXPECT_ERROR(read(*dataset, 0, {0, 1}).status, code, part);
    };
    wrong([&] { fs::remove(object / "pose/000001.txt"); },
          "images without pose: 1 (first '000001')");
    wrong([&] { fs::remove(object / "rgb/000000.png"); },
          "poses without image: 1 (first '000000')");
    wrong([&] { put_image(object / "depth/000001.png", 8, 1); }, "2 poses and 1 images in depth");
    wrong([&] { put_text(object / "rgb/000000.png", "no image"); }, "000000.png': not a PNG");
    wrong([&] { put_text(object / "rgb/000001.png", "no image"); }, "000001.png': not a PNG");
    wrong([&] { put_text(object / "pose/000001.txt", "1 2 3"); },
          "000001.txt': 3 numbers, expected 16");
    wrong([&] { put_text(object / "pose/000001.txt", "1 2 x"); },
          "000001.txt': no number at byte 4");
    wrong([&] { put_text(object / "pose/000001.txt", "nan 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"); },
          "000001.txt': the matrix is not finite");
    wrong([&] { put_text(object / "pose/000001.txt", "2 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"); },
          "000001.txt': rows 0 and 0");
    wrong([&] { put_text(object / "intrinsics.txt", "0 4 4 0 0 0 0 1 8 8"); }, "intrinsics.txt'");
    wrong([&] { put_text(object / "pose/000001.txt", "1 0 0 1e12 0 1 0 0 0 0 1 0 0 0 0 1"); },
          "000001.txt': the camera is 1e+12 from the origin, expected at most 1e+06");
    const auto wrong_lens = [&](const char* text, const char* part) {
        wrong([&] { put_text(object / "intrinsics.txt", text); }, part);
    };
    wrong_lens("10 4 4", "intrinsics.txt': 3 numbers, expected 10");
    wrong_lens("10 4 4 0\n0 0 0\n1\n8", "9 numbers, expected 10");
    wrong_lens("inf 4 4 0\n0 0 0\n1\n8 8", "number 1 of 10 is inf, expected a finite one");
    wrong_lens("10 nan 4 0\n0 0 0\n1\n8 8", "number 2 of 10 is nan");
    wrong_lens("10 4 4 0\n0 0 0\n1\n8 inf", "number 10 of 10 is inf");
    wrong_lens("10 4 4 0\n0 0 0\n1\n8 8.5", "height and width, are 8 and 8.5, expected whole");
    wrong_lens("1e-300 4 4 0\n0 0 0\n1\n8 8", "focal lengths are 1e-300");
    wrong_lens("10 1e308 4 0\n0 0 0\n1\n8 8", "the principal point is 1e+308, 4");
    wrong(
        [&] {
            fs::remove(object / "rgb/000001.png");
            fs::remove(object / "pose/000001.txt");
        },
        "1 views, expected 2 or more");
    wrong([&] { fs::remove_all(object); }, "holds no folder with intrinsics.txt", Code::kFormat);
}

TEST(Dataset, ReadsMapsThatAllObjectsHave) {
    const SampleFolder folder;
    write_all(sample_cars(folder.path()));
    DatasetDesc desc = data_desc(folder.path());
    desc.maps = 7;
    const auto dataset = open_data(desc);
    const Read r = read(*dataset, 0, {2, 0}, true);
    ASSERT_OK(r.status);
    std::size_t inside = 0;
    for (std::size_t i = 0; i < r.masks.size(); ++i) {
        EXPECT_TRUE(r.masks[i] == 0 || r.masks[i] == 1);
        inside += r.masks[i] == 1;
        if (r.masks[i] == 0) {
            EXPECT_EQ(r.depths[i], 0);
        }
    }
    EXPECT_GT(inside, 40U);
    EXPECT_EQ(*std::max_element(r.depths.begin(), r.depths.end()), 254.0F / 255);
    EXPECT_NEAR(r.focals[0], 131.25 / 8, 1e-6);
    fs::remove_all(folder / "srn_cars/cars_train/000001_car/normal");
    EXPECT_ERROR(open_status(folder.path(), 3), Code::kNotFound,
                 "maps requested: depth, normal; every object has: depth, mask");
    EXPECT_OK(open_status(folder.path(), 5));
    desc.maps = 0;
    EXPECT_ERROR(read(*open_data(desc), 0, {0}, true).status, Code::kNotFound,
                 "maps requested: normal");
}

TEST(Dataset, ShowsTheBackgroundBehindTransparentPixels) {
    const SampleFolder folder;
    for (const char* name : {"a", "b"})
        put_renders(folder / name, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -2,  //
                                    1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, -2});
    put_image(folder / "a/000.png", 8, 4, 0, 51);
    put_image(folder / "a/001.png", 8, 4, 0, 0);
    DatasetDesc desc = data_desc(folder.path());
    desc.background = {1, 0.5F, 0};
    const Read r = read(*open_data(desc), 0, {0, 1});
    ASSERT_OK(r.status);
    EXPECT_EQ(r.images[0], 204.0F / 255) << "0.2 of 0 and 0.8 of 255";
    EXPECT_EQ(r.images[3 * 64], 1);
    EXPECT_EQ(r.images[4 * 64], 128.0F / 255);
    EXPECT_EQ(r.images[5 * 64], 0);
}

TEST(Dataset, GivesOtherResolutions) {
    const SampleFolder folder;
    put_object(folder / "cars_train/a");
    DatasetDesc desc = data_desc(folder.path());
    desc.resolution = 4;
    const auto dataset = open_data(desc);
    const Read r = read(*dataset, 0, {0});
    ASSERT_OK(r.status);
    EXPECT_EQ(r.images.size(), 48U);
    EXPECT_EQ(r.focals, (std::vector<float>{5, 5}));
    const auto stored =
        io::read_png(io::read_file((folder / "cars_train/a/rgb/000000.png").string()).value());
    const io::Image small = resample(stored.value(), 4, 4, Filter::kBicubic).value();
    for (std::size_t i = 0; i < 16; ++i)
        for (std::size_t c = 0; c < 3; ++c)
            EXPECT_EQ(r.images[c * 16 + i], static_cast<float>(small.samples[i * 3 + c]) / 255.0F);
}

TEST(Dataset, SameBitsFromSmallAndLargeCachesInManyThreads) {
    const SampleFolder folder;
    write_all(sample_cars(folder.path()));
    DatasetDesc desc = data_desc(folder.path());
    const auto large = open_data(desc);
    desc.cache_bytes = 2000;  // two images
    const auto small = open_data(desc);
    std::vector<Read> expected;
    for (std::uint32_t object = 0; object < 2; ++object)
        expected.push_back(read(*large, object, {0, 1, 2}, true));
    std::vector<std::thread> threads;
    for (std::uint32_t t = 0; t < 4; ++t)
        threads.emplace_back([&, t] {
            for (std::uint32_t i = 0; i < 6; ++i) {
                const std::uint32_t object = (i + t) % 2;
                for (Dataset* dataset : {large.get(), small.get()}) {
                    const Read r = read(*dataset, object, {0, 1, 2}, true);
                    EXPECT_OK(r.status);
                    EXPECT_EQ(r.images, expected[object].images);
                    EXPECT_EQ(r.normals, expected[object].normals);
                    EXPECT_EQ(r.poses, expected[object].poses);
                }
            }
        });
    for (std::thread& thread : threads) thread.join();
    EXPECT_LE(small->cache().bytes(), 2000U);
    EXPECT_EQ(large->cache().bytes(), 2 * 3 * 16 * 16 * 8U);
}

TEST(Dataset, RefusesInvalidDescsAndNumbers) {
    const SampleFolder folder;
    put_object(folder / "cars_train/a");
    DatasetDesc good;
    good.path = folder.path().string();
    const auto refused = [&good](auto change, const char* part,
                                 Code code = Code::kInvalidArgument) {
        DatasetDesc desc = good;
        change(desc);
        EXPECT_ERROR(Dataset::open(desc), code, part);
    };
    refused([](DatasetDesc& d) { d.format = "x"; },
            "format is 'x', expected one of store, tables, srn");
    refused([](DatasetDesc& d) { d.split = "all"; }, "split is 'all'");
    refused([](DatasetDesc& d) { d.path = "/nonexistent"; }, "/nonexistent", Code::kNotFound);
    refused([](DatasetDesc& d) { d.resolution = 4097; }, "4097");
    refused([](DatasetDesc& d) { d.background[1] = std::numeric_limits<float>::quiet_NaN(); },
            "background");
    const auto dataset = open_data(good);
    EXPECT_ERROR(read(*dataset, 1, {0}).status, Code::kInvalidArgument,
                 "object is 1, expected less than 1");
    EXPECT_ERROR(read(*dataset, 0, {0, 2}).status, Code::kInvalidArgument,
                 "view is 2, but object 0 ('a') has");
    EXPECT_OK(dataset->read(0, {}, {}));
}

TEST(Dataset, ReportsWhatItHolds) {
    const SampleFolder folder;
    put_object(folder / "cars_train/a");
    put_object(folder / "cars_train/b");
    DatasetDesc desc = data_desc(folder.path());
    desc.limit = 1;
    desc.resolution = 4;
    EXPECT_EQ(
        report_text(*open_data(desc)),
        R"({"format": "srn", "split": "train", "has_splits": true, "objects": 1, "views": 2, )"
        R"("excluded": 0, "missing": [], "not_objects": [], "not_read": [], "not_read_count": 0, )"
        R"("notes": [], "resolution": 4, "stored_resolution": 8, "maps": [], "names": ["a"], "views_of": [2]})");
}

}  // namespace
}  // namespace splat::data

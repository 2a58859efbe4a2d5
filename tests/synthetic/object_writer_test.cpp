#include "synthetic/object_writer.h"

#include <gtest/gtest.h>

#include <map>
#include <thread>

#include "scene/camera_pose.h"
#include "support/expect_status.h"
#include "support/system.h"
#include "synthetic/ray_caster.h"
#include "synthetic/sample_folder.h"

namespace splat::synthetic {
namespace {

namespace fs = std::filesystem;
using test::file_text;
using test::sample_cars;
using test::SampleFolder;

/// All files of a folder with their contents.
std::map<std::string, std::string> contents(const fs::path& folder) {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
        if (entry.is_regular_file())
            files[entry.path().lexically_relative(folder).generic_string()] =
                file_text(entry.path());
    return files;
}

TEST(ObjectWriter, WritesTheLayoutOfSrn) {
    const SampleFolder folder;
    test::write_all(sample_cars(folder.path()));
    const auto files = contents(folder.path());
    EXPECT_EQ(files.size(), 1 + (2 + 2) + (2 * 3 + 2 * 4) * 5U);
    const std::string object = "srn_cars/cars_train/000001_car/";
    for (const char* name : {"intrinsics.txt", "pose/000002.txt", "rgb/000002.png",
                             "depth/000002.png", "normal/000002.png", "mask/000002.png"})
        EXPECT_EQ(files.count(object + name), 1U) << name;
    EXPECT_EQ(files.at(object + "intrinsics.txt"), "16.40625 8 8 0\n0 0 0\n1\n16 16\n");
    EXPECT_EQ(files.count("srn_cars/cars_val/000000_car/pose/000003.txt"), 1U);
    EXPECT_EQ(files.count("srn_cars/cars_test/000000_car/pose/000003.txt"), 1U);
}

TEST(ObjectWriter, SameSeedSameBytesWhateverTheThreads) {
    const SampleFolder one;
    const SampleFolder other;
    const WriterDesc desc = sample_cars(one.path());
    test::write_all(desc);
    WriterDesc again = desc;
    again.path = other.path().string();
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i)  // each writes all objects, so two often write the same one
        threads.emplace_back([&again, i] {
            for (std::uint32_t k = 0; k < 4; ++k)
                EXPECT_OK(write_object(again, (k + static_cast<std::uint32_t>(i)) % 4));
        });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(contents(one.path()), contents(other.path()));
    const SampleFolder third;
    WriterDesc seeded = desc;
    seeded.path = third.path().string();
    seeded.seed = 6;
    test::write_all(seeded);
    const std::string image = "srn_cars/cars_train/000000_car/rgb/000000.png";
    EXPECT_NE(contents(one.path()).at(image), contents(third.path()).at(image));
}

TEST(ObjectWriter, MoreObjectsLeaveTheOthersUnchanged) {
    const SampleFolder folder;
    WriterDesc desc = sample_cars(folder.path());
    test::write_all(desc);
    const auto before = contents(folder.path());
    desc.train_objects = 3;
    test::write_all(desc);
    auto after = contents(folder.path());
    EXPECT_GT(after.size(), before.size());
    for (const auto& [name, bytes] : before) EXPECT_EQ(after.at(name), bytes) << name;
}

TEST(ObjectWriter, AnInterruptedObjectIsWrittenAnew) {
    const SampleFolder folder;
    const WriterDesc desc = sample_cars(folder.path());
    // Leftovers of a killed process; no running process has such a number.
    const fs::path split = folder / "srn_cars/cars_train";
    test::put_text(split / ".000000_car.2000000000-0.tmp/rgb/000000.png", "part");
    test::put_text(split / ".000001_car.2000000000-0.tmp/rgb/000000.png", "part");
    ASSERT_OK(write_object(desc, 0));
    EXPECT_FALSE(fs::exists(split / ".000000_car.2000000000-0.tmp"));
    EXPECT_TRUE(fs::exists(split / ".000001_car.2000000000-0.tmp")) << "another object's";
    EXPECT_TRUE(fs::exists(split / "000000_car/intrinsics.txt"));
}

TEST(ObjectWriter, AKilledProcessOfTheSameNumberBlocksNoObject) {
    const SampleFolder folder;
    const fs::path split = folder / "srn_cars/cars_train";
    for (int k = 0; k < 1000; ++k)
        test::put_text(split / (".000000_car." + test::process_text() + "-" + std::to_string(k) +
                                ".tmp/rgb/000000.png"),
                       "part");
    ASSERT_OK(write_object(sample_cars(folder.path()), 0));
    EXPECT_NE(file_text(split / "000000_car/rgb/000000.png"), "part");
}

TEST(ObjectWriter, RefusesAFolderWithOtherParameters) {
    const SampleFolder folder;
    WriterDesc desc = sample_cars(folder.path());
    ASSERT_OK(write_object(desc, 0));
    desc.seed = 7;
    EXPECT_ERROR(write_object(desc, 0), Code::kInvalidArgument, "\"seed\": 5");
}

TEST(ObjectWriter, RefusesInvalidDescs) {
    const SampleFolder folder;
    const WriterDesc good = sample_cars(folder.path());
    const auto refused = [&good](auto change, Code code, const char* part) {
        WriterDesc desc = good;
        change(desc);
        EXPECT_ERROR(write_object(desc, 0), code, part);
    };
    refused([](WriterDesc& d) { d.path = ""; }, Code::kInvalidArgument, "path");
    refused([](WriterDesc& d) { d.category = "boats"; }, Code::kInvalidArgument, "'boats'");
    refused([](WriterDesc& d) { d.resolution = 7; }, Code::kInvalidArgument, "7");
    refused([](WriterDesc& d) { d.resolution = 2049; }, Code::kUnsupported, "2049");
    refused([](WriterDesc& d) { d.train_views = 0; }, Code::kInvalidArgument, "views");
    refused([](WriterDesc& d) { d.train_objects = d.val_objects = d.test_objects = 0; },
            Code::kInvalidArgument, "0 objects");
    refused([](WriterDesc& d) { d.path = "/proc/none"; }, Code::kNotFound, "/proc/none");
    EXPECT_ERROR(write_object(good, 4), Code::kInvalidArgument, "index is 4");
}

TEST(ObjectWriter, CamerasLookAtTheOriginFromEverywhere) {
    WriterDesc desc = sample_cars("x");
    desc.test_views = 251;
    double lowest = 1;
    double highest = -1;
    for (std::uint32_t view = 0; view < 200; ++view) {
        const scene::Camera camera = view_camera(desc, Split::kTrain, 0, view);
        ASSERT_OK(scene::check_camera(camera));
        const Vec3 eye = scene::camera_center(camera);
        EXPECT_NEAR(glm::length(eye), 1.3, 1e-12);
        const auto& m = camera.world_to_camera;
        EXPECT_NEAR(m[3], 0, 1e-12) << "the origin is in the middle of the image";
        EXPECT_NEAR(m[7], 0, 1e-12);
        lowest = std::min(lowest, eye[2]);
        highest = std::max(highest, eye[2]);
    }
    EXPECT_LT(lowest, -1.2);
    EXPECT_GT(highest, 1.2);
    double last = 0;
    for (std::uint32_t view = 0; view < 251; ++view) {
        const Vec3 eye = scene::camera_center(view_camera(desc, Split::kTest, 0, view));
        EXPECT_GT(eye[2], last) << "the spiral climbs";
        last = eye[2];
    }
    const Vec3 shown = scene::camera_center(view_camera(desc, Split::kTest, 0, 64));
    EXPECT_GT(shown[0], 0.7) << "view 64 sees front";
    EXPECT_GT(shown[1], 0.7) << "and side";
}

/// Depths lie between znear and zfar of the reference's cars, and something is seen everywhere.
TEST(ObjectWriter, ObjectsLieBetweenTheReferencesPlanes) {
    const WriterDesc desc = sample_cars("x");
    for (std::uint32_t object = 0; object < 6; ++object) {
        Random random(desc.seed, 0, object, 0);
        const Solids solids = fitted(object % 2 == 0 ? make_car(random) : make_chair(random));
        for (std::uint32_t view = 0; view < 6; ++view) {
            const Picture picture = cast(solids, view_camera(desc, Split::kTrain, object, view));
            int hits = 0;
            for (const float depth : picture.depth) {
                if (depth == 0) continue;
                ++hits;
                EXPECT_GE(depth, 0.8F);
                EXPECT_LE(depth, 1.8F);
            }
            EXPECT_GT(hits, 10);
        }
    }
}

}  // namespace
}  // namespace splat::synthetic

// Photographs with cameras as a fit reads them.
#include "data/posed_photos.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "data/sample_formats.h"
#include "io/bytes.h"
#include "io/file.h"
#include "support/expect_status.h"
#include "support/real_data.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;
using namespace test;
using Options = PosedPhotosOptions;

constexpr const char* kNames[] = {"d.png", "a.png", "c.png", "b.png"};

void put_four(const fs::path& folder, std::uint32_t channels = 3) {
    for (const char* name : kNames)
        put_image(folder / name, 8, channels, static_cast<std::uint32_t>(name[0] - 'a'));
}

/// A text model of four cameras on a line, 8 x 8 pixels.
void put_text_model(const fs::path& folder, const std::string& lens = "PINHOLE 8 8 10 11 4 4.5") {
    std::string images;
    for (int i = 0; i < 4; ++i) images += format("%d 1 0 0 0 %d 0 4 1 %s\n\n", i + 1, i, kNames[i]);
    put_text(folder / "cameras.txt", "1 " + lens + "\n");
    put_text(folder / "images.txt", images);
    put_text(folder / "points3D.txt", "7 1 2 3 10 20 255 0.5 1 2\n3 4 5 6 0 1 2 0.5\n");
}

/// The same model in COLMAP's binary form.
void put_binary_model(const fs::path& folder) {
    using io::put;
    const auto write = [&folder](const char* name, const io::Buffer& file) {
        fs::create_directories(folder);
        ASSERT_OK(io::write_file((folder / name).string(), file));
    };
    io::Buffer cameras, images, points;
    put(cameras, std::uint64_t{1});
    put(cameras, std::int32_t{1});
    put(cameras, std::int32_t{1});  // PINHOLE
    for (int k = 0; k < 2; ++k) put(cameras, std::uint64_t{8});
    for (const double value : {10.0, 11.0, 4.0, 4.5}) put(cameras, value);
    put(images, std::uint64_t{4});
    for (int i = 0; i < 4; ++i) {
        put(images, std::int32_t{i + 1});
        for (const double value : {1.0, 0.0, 0.0, 0.0, i * 1.0, 0.0, 4.0}) put(images, value);
        put(images, std::int32_t{1});
        io::put_text(images, kNames[i]);
        put(images, std::uint8_t{0});
        put(images, std::uint64_t{0});
    }
    put(points, std::uint64_t{2});
    for (int i = 0; i < 2; ++i) {
        put(points, std::uint64_t{9});
        for (int k = 1; k < 4; ++k) put(points, 3.0 * i + k);
        for (const int value : {10, 20, 255}) put(points, static_cast<std::uint8_t>(value - 5 * i));
        put(points, 0.5);
        put(points, std::uint64_t{1});
        put(points, std::uint64_t{0});
    }
    write("cameras.bin", cameras);
    write("images.bin", images);
    write("points3D.bin", points);
}

PosedPhotos load(const fs::path& folder, const Options& options = {}) {
    return need(load_posed_photos(folder.string(), options));
}

Status status_of(const fs::path& folder, const Options& options = {}) {
    return load_posed_photos(folder.string(), options).status();
}

std::string notices_of(const PosedPhotos& photos) {
    std::string all;
    for (const std::string& notice : photos.notices) all += notice + "\n";
    return all;
}

/// "a*bcd": names without extension, those held out with a star behind.
std::string names_of(const PosedPhotos& photos) {
    std::string all;
    for (const PosedPhoto& photo : photos.photos)
        all += fs::path(photo.name).stem().string() + (photo.held_out ? "*" : "");
    return all;
}

std::size_t there(const PosedPhoto& photo) {
    return photo.pixels.size() -
           static_cast<std::size_t>(std::ranges::count(photo.pixels, std::uint32_t{0}));
}

constexpr std::uint32_t rgb(std::uint32_t r, std::uint32_t g, std::uint32_t b) {
    return r | g << 8 | b << 16 | 255U << 24;
}

TEST(PosedPhotos, OfATextModelAreByName) {
    const SampleFolder folder;
    put_four(folder / "images");
    put_image(folder / "images/spare.png", 8, 3);
    put_text_model(folder / "sparse/0");
    put_text(folder / "transforms.json", "{}");
    const PosedPhotos read = load(folder.path(), {.test_every = 3});
    EXPECT_EQ(names_of(read), "a*bcd*");
    const PosedPhoto& b = read.photos[1];
    EXPECT_EQ(b.name, "b.png");
    EXPECT_EQ(b.width, 8U);
    EXPECT_EQ(b.camera.height, 8U);
    EXPECT_EQ(b.camera.fy, 11);
    EXPECT_EQ(b.camera.cy, 4.5);
    EXPECT_EQ(b.camera.world_to_camera[3], 3);
    ASSERT_EQ(b.pixels.size(), 64U);
    EXPECT_EQ(b.pixels[8 * 2 + 3], rgb(32 + 12 + 1, 32 + 12 + 2, 32 + 12 + 3));
    ASSERT_EQ(read.points.size(), 2U);
    EXPECT_EQ(read.points[0], scene::Vec3(1, 2, 3));
    EXPECT_EQ(read.colors[0], (std::array<std::uint8_t, 3>{10, 20, 255}));
    EXPECT_EQ(read.colors[1], (std::array<std::uint8_t, 3>{0, 1, 2}));
    EXPECT_EQ(
        notices_of(read),
        "the cameras are those of the COLMAP model 'sparse/0/cameras.txt'; transforms.json is "
        "not read\n"
        "2 of 4 photographs are held out: 1 of 3 by name\n"
        "1 pictures of images/ are not used, such as 'spare.png', which has no camera\n");
    EXPECT_EQ(names_of(load(folder.path(), {.test_every = 0})), "abcd");
}

TEST(PosedPhotos, OfABinaryModelAreThoseOfTheTextModel) {
    const SampleFolder folder;
    put_four(folder.path());
    put_text_model(folder.path());
    const PosedPhotos text = load(folder.path());
    put_binary_model(folder.path());
    const PosedPhotos binary = load(folder.path());
    EXPECT_HAS(binary.notices[0], "'cameras.bin'");
    ASSERT_EQ(names_of(text), names_of(binary));
    for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_EQ(text.photos[i].pixels, binary.photos[i].pixels);
        EXPECT_EQ(text.photos[i].camera.world_to_camera, binary.photos[i].camera.world_to_camera);
        EXPECT_EQ(text.photos[i].camera.fy, binary.photos[i].camera.fy);
    }
    EXPECT_EQ(text.points, binary.points);
    EXPECT_EQ(binary.colors[1], (std::array<std::uint8_t, 3>{5, 15, 250}));
}

TEST(PosedPhotos, AreUndistortedAndReduced) {
    const SampleFolder folder;
    put_four(folder.path());
    put_text_model(folder.path(), "OPENCV 8 8 10 11 4 4.5 0.1 0 0 0.01");
    const PosedPhotos read = load(folder.path(), {.downscale = 2});
    const PosedPhotos whole = load(folder.path());
    const PosedPhoto& photo = read.photos[0];
    EXPECT_EQ(photo.width, 4U);
    EXPECT_EQ(photo.camera.fx, 5);
    EXPECT_EQ(photo.camera.cy, 2.25);
    EXPECT_LT(there(whole.photos[0]), 64U);
    EXPECT_GT(there(whole.photos[0]), 32U);
    scene::Lens lens;
    lens.radial[0] = 0.1;
    lens.tangential[1] = 0.01;
    put_text_model(folder.path());
    EXPECT_EQ(photo.pixels, undistort(load(folder.path()).photos[0], lens, 2).pixels);
    EXPECT_HAS(notices_of(whole),
               "the lens of 4 photographs is undone (perspective k1 = 0.1, p2 = 0.01, 'a.png'); ");
    put_text_model(folder.path(), "PINHOLE 8 8 10 11 4 4.5\n2 FOV 8 8 10 10 4 4 0.5");
    EXPECT_LACKS(notices_of(load(folder.path())), "undone") << "no photograph has that lens";
    EXPECT_ERROR(status_of(folder.path(), {.downscale = 9}), Code::kInvalidArgument,
                 "downscale is 9, expected at most 8");
}

TEST(PosedPhotos, OfASmallerFolderAreTakenWhereAllAreThere) {
    const SampleFolder folder;
    put_text_model(folder.path());
    put_four(folder / "images");
    for (const char* name : {"a", "b", "c"})
        put_image(folder / ("images_2/" + std::string(name) + ".png"), 4, 3, 7);
    EXPECT_HAS(notices_of(load(folder.path(), {.downscale = 2})),
               "'images_2' lacks 'd.png': photographs of full size are reduced instead");
    put_image(folder / "images_2/d.png", 4, 3, 8);
    const PosedPhotos read = load(folder.path(), {.downscale = 2});
    EXPECT_HAS(notices_of(read), "those of 'images_2'");
    EXPECT_EQ(read.photos[0].pixels[0], rgb(7, 8, 9));
    EXPECT_EQ(read.photos[0].camera.fx, 5);
    EXPECT_EQ(read.photos[0].camera.cy, 2.25);
    put_image(folder / "images_2/d.png", 6, 3);
    EXPECT_ERROR(status_of(folder.path(), {.downscale = 2}), Code::kFormat,
                 "images_2/d.png': 6 x 6 pixels, its camera has 8 x 8, of which it should be 1/2");
}

TEST(PosedPhotos, AlphaIsAMaskOrLiesOnWhite) {
    const SampleFolder folder;
    put_text_model(folder.path());
    put_four(folder.path());
    const io::Image image{8, 8, 4, 8, [] {
                              std::vector<std::uint16_t> samples(256, 100);
                              for (std::size_t i = 3; i < 256; i += 4) samples[i] = 255;
                              samples[3] = 51;
                              samples[7] = 0;
                              return samples;
                          }()};
    put_png(folder / "b.png", image);
    const PosedPhoto masked = load(folder.path()).photos[1];
    EXPECT_EQ(there(masked), 62U);
    EXPECT_EQ(masked.pixels[0], 0U);
    EXPECT_EQ(masked.pixels[2], rgb(100, 100, 100));
    const PosedPhoto white = load(folder.path(), {.white_background = true}).photos[1];
    EXPECT_EQ(white.pixels[0], rgb(224, 224, 224)) << "100 x 0.2 + 255 x 0.8";
    EXPECT_EQ(white.pixels[1], rgb(255, 255, 255));
    EXPECT_EQ(white.pixels[2], rgb(100, 100, 100));
}

TEST(PosedPhotos, MasksLeavePixelsOut) {
    const SampleFolder folder;
    put_text_model(folder.path());
    put_four(folder / "images");
    const auto put_mask = [&](const char* name, std::uint16_t last) {
        std::vector<std::uint16_t> samples(64, 0);
        std::fill(samples.begin() + 16, samples.end(), last);
        put_png(folder / "masks" / name, {8, 8, 1, 8, samples});
    };
    put_mask("a.png", 1);
    put_mask("b.png.png", 255);
    put_mask("c.png", 255);
    const Options options{.masks = (folder / "masks").string()};
    EXPECT_ERROR(status_of(folder.path(), options), Code::kNotFound,
                 "1 of 4 masks are missing, such as '" + (folder / "masks/d.png").generic_string());
    put_mask("d.png", 0);
    const PosedPhotos read = load(folder.path(), options);
    EXPECT_EQ(names_of(read), "a*bc");
    for (const PosedPhoto& photo : read.photos) {
        EXPECT_EQ(there(photo), 48U);
        EXPECT_EQ(photo.pixels[15], 0U);
        EXPECT_NE(photo.pixels[16], 0U);
    }
    EXPECT_HAS(notices_of(read),
               "1 of 4 photographs have no pixel that counts, such as 'd.png', and are left out");
    put_mask("b.png.png", 0);
    EXPECT_ERROR(status_of(folder.path(), options), Code::kFormat, "2 of 4 photographs have no");
    put_image(folder / "masks/b.png.png", 9, 1);
    EXPECT_ERROR(status_of(folder.path(), options), Code::kFormat, "masks/b.png.png': 9 x 9");
}

/// Pictures NAME0.png, NAME1.png and so on, each another one.
void put_numbered(const fs::path& name, std::uint32_t count, std::uint32_t channels = 3) {
    for (std::uint32_t i = 0; i < count; ++i)
        put_image(name.string() + std::to_string(i) + ".png", 8, channels, i);
}

/// A transforms.json of frames images/0.png and so on, with these members.
void put_transforms(const fs::path& file, const std::string& members, int count,
                    const std::string& of_frames = "", const std::string& names = "images/") {
    std::string frames;
    for (int i = 0; i < count; ++i)
        frames += format(
            R"(%s{"file_path": "%s%d", %s "transform_matrix":
                [[1,0,0,%d],[0,1,0,0],[0,0,1,4],[0,0,0,1]]})",
            i == 0 ? "" : ",", names.c_str(), i, of_frames.c_str(), i);
    put_text(file, R"({"fl_x": 10, )" + members + "\"frames\": [" + frames + "]}");
}

TEST(PosedPhotos, OfTransformsHaveTheirSplit) {
    const SampleFolder folder;
    put_numbered(folder / "images/", 5);
    const fs::path file = folder / "transforms.json";
    put_transforms(file, "", 5);
    const PosedPhotos read = load(folder.path());
    EXPECT_EQ(names_of(read), "0*1234");
    EXPECT_EQ(notices_of(read),
              "the cameras are those of 'transforms.json'\n"
              "1 of 5 photographs are held out: 1 of 8 by name\n");
    EXPECT_TRUE(read.points.empty());
    put_transforms(file, R"("test_filenames": ["images/2"], "train_filenames": ["images/1",
                             "images/3", "images/4"], "val_filenames": ["images/4"], )",
                   5);
    EXPECT_EQ(names_of(load(folder.path())), "12*34");
    EXPECT_HAS(notices_of(load(folder.path())), "1 frames are in no split that is used");
    put_transforms(file, R"("val_filenames": ["images/4"], )", 5);
    EXPECT_EQ(names_of(load(folder.path())), "01234*") << "to score, where no test is given";
    put_transforms(file, R"("test_filenames": ["images/9"], )", 5);
    EXPECT_ERROR(status_of(folder.path()), Code::kFormat, "a split names 'images/9', which no");
    EXPECT_ERROR(status_of(folder.path(), {.cameras = Options::Cameras::kColmap}), Code::kNotFound,
                 "no cameras");
}

TEST(PosedPhotos, OfSplitFilesAreToFitAndToScore) {
    const SampleFolder folder;
    for (const char* split : {"train", "val", "test"}) {
        put_transforms(folder / ("transforms_" + std::string(split) + ".json"), "", 3, "",
                       "./" + std::string(split) + "/r_");
        put_numbered(folder / split / "r_", 3, 4);
    }
    const PosedPhotos read = load(folder.path());
    EXPECT_EQ(names_of(read), "r_0*r_1*r_2*r_0r_1r_2");
    EXPECT_EQ(read.photos[0].name, "./test/r_0");
    EXPECT_EQ(read.notices[0],
              "the cameras are those of 'transforms_train.json', and to score "
              "'transforms_test.json'");
    EXPECT_EQ(read.notices[1], "3 of 6 photographs are held out: those of the data's own split");
    for (const char* split : {"val", "test"})
        fs::remove(folder / ("transforms_" + std::string(split) + ".json"));
    EXPECT_EQ(names_of(load(folder.path(), {.test_every = 3})), "r_0*r_1r_2");
}

TEST(PosedPhotos, OfTransformsHaveMasksAndPoints) {
    const SampleFolder folder;
    put_numbered(folder / "images/", 3);
    put_png(folder / "m.png", {8, 8, 1, 8, [] {
                                   std::vector<std::uint16_t> samples(64, 255);
                                   samples[5] = 0;
                                   return samples;
                               }()});
    put_transforms(folder / "transforms.json", R"("ply_file_path": "points.ply", )", 3,
                   R"("mask_path": "m.png", )");
    EXPECT_HAS(notices_of(load(folder.path())), "points.ply', which ply_file_path names");
    const std::string ply =
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty "
        "float z\n";
    put_text(folder / "points.ply", ply + "end_header\n1 2 3\nnan 0 0\n0 inf 0\n1e9 0 0\n");
    const PosedPhotos gray = load(folder.path());
    for (const PosedPhoto& photo : gray.photos) EXPECT_EQ(there(photo), 63U);
    ASSERT_EQ(gray.points.size(), 1U);
    EXPECT_EQ(gray.points[0], scene::Vec3(1, 2, 3));
    EXPECT_EQ(gray.colors[0], (std::array<std::uint8_t, 3>{128, 128, 128}));
    EXPECT_HAS(notices_of(gray), "2 of 4 points are left out: they are not finite");
    EXPECT_HAS(notices_of(gray), "1 of 4 points are left out: they are 10,000 times farther away");
    put_text(folder / "points.ply",
             ply + "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n" +
                 "1 2 3 4 5 6\n1 2 4 7 8 9\n0 0 0 0 0 0\n0 0 0 0 0 255\n");
    const PosedPhotos colored = load(folder.path());
    ASSERT_EQ(colored.points.size(), 4U);
    EXPECT_EQ(colored.colors[1], (std::array<std::uint8_t, 3>{7, 8, 9}));
    put_transforms(folder / "transforms.json", "", 3, R"("mask_path": "none.png", )");
    EXPECT_ERROR(status_of(folder.path()), Code::kNotFound, "3 of 3 masks are missing");
}

TEST(PosedPhotos, NamesAreThoseOfEverySystem) {
    const SampleFolder folder;
    put_numbered(folder / "images/", 3);
    const auto refused = [&folder](const std::string& members, const std::string& of_frames,
                                   const std::string& names) {
        put_transforms(folder / "transforms.json", members, 3, of_frames, names);
        EXPECT_ERROR(status_of(folder.path()), Code::kFormat, "expected one with '/'") << names;
    };
    put_transforms(folder / "transforms.json", "", 3, "",
                   "../" + folder.path().filename().string() + "/images/");
    EXPECT_EQ(load(folder.path()).photos.size(), 3U) << "a path of the data's author may leave it";
    for (const char* names : {R"(images\\)", R"(..\\..\\)", "C:", R"(\\\\host\\)", "//host/"}) {
        refused("", "", names);
        refused("", R"("mask_path": ")" + std::string(names) + "m.png\", ", "images/");
        refused(R"("ply_file_path": ")" + std::string(names) + "p.ply\", ", "", "images/");
    }
}

TEST(PosedPhotos, SayWhatIsWrong) {
    const SampleFolder folder;
    EXPECT_ERROR(status_of(folder / "nothing"), Code::kNotFound, "nothing' is no folder");
    EXPECT_ERROR(status_of(folder.path()), Code::kNotFound,
                 "' has no cameras: neither a COLMAP model (cameras.bin or cameras.txt, also in "
                 "sparse/0 or sparse) nor transforms.json; 'colmap automatic_reconstructor "
                 "--workspace_path ");
    put_four(folder / "images");
    EXPECT_ERROR(status_of(folder.path()), Code::kNotFound, "images' holds 4 pictures, but there");
    EXPECT_ERROR(status_of(folder.path()), Code::kNotFound, "colmap automatic_reconstructor");
    put_text_model(folder.path());
    fs::remove(folder / "images/c.png");
    fs::remove(folder / "images/a.png");
    EXPECT_ERROR(status_of(folder.path()), Code::kNotFound,
                 "2 of 4 photographs are missing, such as 'a.png'");
    put_text(folder / "images/a.png", std::string("\0\0\0\x18"
                                                  "ftypheic",
                                                  12));
    put_image(folder / "images/c.png", 8, 3);
    EXPECT_ERROR(status_of(folder.path()), Code::kFormat, "a.png': a HEIC file; convert it");
    put_image(folder / "images/a.png", 9, 3);
    EXPECT_ERROR(status_of(folder.path()), Code::kFormat,
                 "images/a.png': 9 x 9 pixels, its camera has 8 x 8: cameras are those of the "
                 "photographs as they are stored");
    put_image(folder / "images/a.png", 8, 3);
    EXPECT_ERROR(status_of(folder.path(), {.test_every = 1}), Code::kInvalidArgument,
                 "0 of 4 photographs are left to fit, expected at least 2");
    put_text(folder / "images.txt", "1 1 0 0 0 0 0 4 1 a.png\n\n");
    EXPECT_ERROR(status_of(folder.path(), {.test_every = 0}), Code::kInvalidArgument,
                 "1 of 1 photographs are left to fit");
    put_text(folder / "images.txt", "1 1 0 0 nan 0 0 4 1 a.png\n\n");
    EXPECT_ERROR(status_of(folder.path()), Code::kFormat, "image 'a.png'");
    put_text(folder / "images.txt", "1 1 0 0 0 inf 0 4 1 a.png\n\n");
    EXPECT_ERROR(status_of(folder.path()), Code::kFormat, "image 'a.png'");
}

TEST(PosedPhotos, OfOneColourAreToldOrRefused) {
    const SampleFolder folder;
    put_text_model(folder.path());
    put_four(folder.path());
    const auto put_plain = [&folder](const char* name, std::uint16_t value) {
        put_png(folder / name, {8, 8, 3, 8, std::vector<std::uint16_t>(192, value)});
    };
    put_plain("c.png", 0);
    EXPECT_HAS(notices_of(load(folder.path())),
               "1 of 4 photographs have one colour alone, such as 'c.png'");
    for (const char* name : {"a.png", "b.png", "d.png"}) put_plain(name, 9);
    EXPECT_ERROR(status_of(folder.path()), Code::kFormat,
                 "all 4 photographs have one colour alone, so that no scene");
    for (const char* name : kNames) put_image(folder / name, 8, 3);
    EXPECT_ERROR(status_of(folder.path()), Code::kFormat, "all 4 photographs are equal");
}

TEST(PosedPhotos, StopWhereProgressSaysSo) {
    const SampleFolder folder;
    put_text_model(folder.path());
    put_four(folder.path());
    std::atomic<std::size_t> most = 0;
    load(folder.path(), {.progress = [&](std::size_t done, std::size_t count) {
             EXPECT_EQ(count, 4U);
             for (std::size_t seen = most; seen < done && !most.compare_exchange_weak(seen, done);)
                 ;
             return Status();
         }});
    EXPECT_EQ(most, 4U);
    const auto stopped = status_of(
        folder.path(), {.progress = [](std::size_t, std::size_t) { return bad_state("stopped"); }});
    EXPECT_ERROR(stopped, Code::kInvalidState, "stopped");
}

TEST(RealPosedPhotos, FoxIsUndistorted) {
    SPLAT_NEEDS_REAL_DATA();
    const PosedPhotos read = load(*real_data_folder() + "/images/fox", {.downscale = 2});
    ASSERT_EQ(read.photos.size(), 50U);
    EXPECT_EQ(std::ranges::count_if(read.photos, &PosedPhoto::held_out), 7);
    EXPECT_EQ(read.points.size(), 12008U);
    const PosedPhoto& first = read.photos[0];
    EXPECT_EQ(first.name, "0001.jpg");
    EXPECT_TRUE(first.held_out);
    EXPECT_EQ(first.width, 270U);
    EXPECT_EQ(first.height, 480U);
    EXPECT_NEAR(static_cast<double>(there(first)) / (270 * 480), 0.978, 0.0005);
    EXPECT_HAS(notices_of(read), "the lens of 50 photographs is undone (perspective k1 = 0.056");
    EXPECT_HAS(notices_of(read), "97.8 % of their pixels count");
    // Most points have the colours of the pixels that they are projected to; others are hidden there.
    std::vector<double> errors;
    for (std::size_t i = 0; i < read.points.size(); ++i) {
        const auto& m = first.camera.world_to_camera;
        scene::Vec3 p{};
        for (std::size_t k = 0; k < 3; ++k)
            p[k] = m[4 * k] * read.points[i].x + m[4 * k + 1] * read.points[i].y +
                   m[4 * k + 2] * read.points[i].z + m[4 * k + 3];
        const double x = first.camera.fx * p.x / p.z + first.camera.cx;
        const double y = first.camera.fy * p.y / p.z + first.camera.cy;
        if (!(p.z > 0 && x >= 0 && y >= 0 && x < 270 && y < 480)) continue;
        const std::uint32_t pixel =
            first.pixels[static_cast<std::size_t>(y) * 270 + static_cast<std::size_t>(x)];
        if (pixel == 0) continue;
        double error = 0;
        for (unsigned k = 0; k < 3; ++k)
            error += std::abs(static_cast<double>(pixel >> 8 * k & 255U) - read.colors[i][k]) / 3;
        errors.push_back(error);
    }
    ASSERT_GT(errors.size(), 10000U);
    std::ranges::sort(errors);
    EXPECT_LT(errors[errors.size() / 2], 30) << "levels of 255; 3 pixels beside it is 38";
    const PosedPhoto quarter = reduce(first, 4);
    EXPECT_EQ(quarter.width, 67U);
    EXPECT_EQ(quarter.camera.cx, (first.camera.cx - 1) / 4) << "270 is cropped left and right";
}

}  // namespace
}  // namespace splat::data

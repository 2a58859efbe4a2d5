// Weights and cameras in memory, and what the system refuses to write. Needs no device.
#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "api/raster_calls.h"
#include "support/system.h"

namespace splat::test {
namespace {

class ApiMemoryFiles : public ::testing::Test {
  protected:
    [[nodiscard]] std::string path(const char* name) const { return folder_ / name; }

    const Temporary folder_;
};

TEST_F(ApiMemoryFiles, WeightsGoOutAndInAgain) {
    const Floats matrix = {1, 2, 3, 4, 5, 6};
    const Floats number = {0.5F};
    const splat_named_array arrays[] = {named_array("matrix", matrix, {2, 3}),
                                        named_array("number", number, {}),
                                        named_array("nothing", {}, {0, 4})};
    const Weights weights = got(splat_weights_from_arrays, arrays, 3);
    const std::pair<const char*, splat_weights_format> formats[] = {
        {"a.safetensors", SPLAT_WEIGHTS_SAFETENSORS},
        {"a.npz", SPLAT_WEIGHTS_NPZ},
        {"a.pth", SPLAT_WEIGHTS_PTH}};
    for (const auto& [name, format] : formats)
        for (const std::uint32_t flags : {0U, std::uint32_t{SPLAT_WEIGHTS_HALF}}) {
            ASSERT_DONE(splat_weights_save(weights, path(name).c_str(), flags));
            const std::string file = bytes_of(splat_weights_save_memory, weights, format, flags);
            EXPECT_EQ(file, file_bytes(path(name))) << name;
            const Weights again = got(splat_weights_load_memory, file.data(), file.size());
            const auto index = got(splat_weights_find, again, "matrix");
            const float* values = nullptr;
            std::uint64_t count = 0;
            ASSERT_DONE(splat_weights_data(again, index, &values, &count));
            EXPECT_EQ(Floats(values, values + count), matrix);
            for (std::size_t size = 0; size < file.size(); ++size) {
                Weights none;
                EXPECT_EQ(splat_weights_load_memory(file.data(), size, none.out()), kFormat)
                    << name << ' ' << size;
            }
        }
    const float* values = matrix.data();
    std::uint64_t count = 7;
    ASSERT_DONE(splat_weights_data(weights, 2, &values, &count));
    EXPECT_EQ(values, nullptr);
    EXPECT_EQ(count, 0U);
    const Weights empty = got(splat_weights_from_arrays, nullptr, 0);
}

/// Copied values do not depend on the file; mapped ones are given without a copy.
TEST_F(ApiMemoryFiles, LargeWeightsAreMappedOrCopied) {
    const std::string file = path("large.safetensors");
    const Floats large = write_large_weights(file);
    const Weights in_place = got(splat_weights_load, file.c_str(), 0);
    const Weights copied = got(splat_weights_load, file.c_str(), SPLAT_WEIGHTS_COPY);
    const float *first = nullptr, *second = nullptr, *own = nullptr;
    ASSERT_DONE(splat_weights_data(in_place, 0, &first, nullptr));
    ASSERT_DONE(splat_weights_data(in_place, 0, &second, nullptr));
    EXPECT_EQ(first, second);
    EXPECT_EQ(std::memcmp(first, large.data(), large.size() * sizeof(float)), 0);
    ASSERT_DONE(splat_weights_data(copied, 0, &own, nullptr));
    EXPECT_NE(own, first);
    std::ofstream(file, std::ios::in | std::ios::out).seekp(-4, std::ios::end) << "\1\1\1\1";
    EXPECT_REFUSED(splat_weights_data(in_place, 0, &first, nullptr), kIo,
                   "was written since it was opened");
    std::uint64_t count = 0;
    ASSERT_DONE(splat_weights_data(copied, 0, &own, &count));
    EXPECT_EQ(Floats(own, own + count), large);
}

TEST_F(ApiMemoryFiles, CamerasGoOutAndInAgain) {
    std::vector<splat_camera> cameras = {sample_camera(64, 48), sample_camera(33, 20, 0.7)};
    cameras[1].cx = 3.25;
    const char* const names[] = {"a.png", "images/\"b\".png"};
    ASSERT_DONE(splat_camera_save(path("c.json").c_str(), cameras.data(), names, 2));
    const std::string file = bytes_of(splat_camera_save_memory, cameras.data(), names, 2);
    EXPECT_EQ(file, file_bytes(path("c.json")));
    auto files = sized<splat_camera_bytes>();
    files.cameras = file.data();
    files.camera_bytes = file.size();
    std::array<splat_camera, 2> read{};
    std::uint32_t count = 0;
    ASSERT_DONE(splat_camera_load_memory(&files, nullptr, read.data(), 2, &count));
    EXPECT_EQ(count, 2U);
    for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_EQ(read[i].width, cameras[i].width);
        EXPECT_EQ(read[i].fx, cameras[i].fx);
        EXPECT_EQ(read[i].cx, cameras[i].cx);
        for (std::size_t k = 0; k < 16; ++k)
            EXPECT_NEAR(read[i].world_to_camera[k], cameras[i].world_to_camera[k], 1e-12);
    }
    char text[256] = "";
    ASSERT_DONE(splat_camera_load_memory_report(&files, nullptr, text, sizeof text, nullptr));
    EXPECT_STREQ(text, R"({"names": ["a.png", "images/\"b\".png"], "warnings": []})");
    EXPECT_EQ(splat_camera_load_memory(&files, nullptr, read.data(), 1, &count), SPLAT_INCOMPLETE);
    for (files.camera_bytes = 0; files.camera_bytes + 2 < file.size(); ++files.camera_bytes)
        EXPECT_EQ(splat_camera_load_memory(&files, nullptr, read.data(), 2, nullptr), kFormat)
            << files.camera_bytes;
    ASSERT_DONE(splat_camera_save(path("none.json").c_str(), nullptr, nullptr, 0));
    ASSERT_DONE(splat_camera_load(path("none.json").c_str(), nullptr, nullptr, 0, &count));
    EXPECT_EQ(count, 0U);
}

TEST_F(ApiMemoryFiles, ColmapModelsAreTwoFiles) {
    const std::string cameras = "1 PINHOLE 64 48 50 51 32 24\n";
    const std::string images = "1 1 0 0 0 1 2 3 1 a.png\n\n";
    auto files = sized<splat_camera_bytes>();
    files.cameras = cameras.data();
    files.camera_bytes = cameras.size();
    files.images = images.data();
    files.image_bytes = images.size();
    splat_camera camera{};
    std::uint32_t count = 0;
    ASSERT_DONE(splat_camera_load_memory(&files, nullptr, &camera, 1, &count));
    EXPECT_EQ(count, 1U);
    EXPECT_EQ(camera.fy, 51);
    std::string binary(8 + 24 + 32, '\0');  // one camera: id, model, width, height, 4 parameters
    const std::uint64_t numbers[] = {1, 0x1'0000'0001U, 64, 48};
    const double parameters[] = {50, 51, 32, 24};
    std::memcpy(binary.data(), numbers, sizeof numbers);
    std::memcpy(binary.data() + sizeof numbers, parameters, sizeof parameters);
    files.cameras = binary.data();
    files.camera_bytes = binary.size();
    EXPECT_REFUSED(splat_camera_load_memory(&files, nullptr, &camera, 1, &count), kFormat, "images")
        << "text images to binary cameras";
}

/// A limit on the size of files stands for a full disk: the system refuses the same call.
TEST_F(ApiMemoryFiles, AFullDiskIsAnErrorOfTheSystem) {
    SPLAT_NEED_FILE_LIMIT();
    const Weights weights = make_weights();
    const Scene scene = SampleScene(50).create();
    {
        const FileLimit small(16);
        EXPECT_REFUSED(splat_weights_save(weights, path("w.npz").c_str(), 0), kIo, "cannot write");
        EXPECT_REFUSED(splat_scene_save(scene, path("s.ply").c_str(), nullptr), kIo,
                       "cannot write");
    }
    EXPECT_TRUE(std::filesystem::is_empty(folder_.path())) << "no part of a file remains";
}

}  // namespace
}  // namespace splat::test

// Scenes drawn in one call.
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "api/raster_calls.h"

namespace splat::test {
namespace {

/// Cameras of two sizes.
std::vector<splat_camera> some_cameras() {
    return {sample_camera(20, 16, 0), sample_camera(20, 16, 1), sample_camera(12, 18, 2)};
}

/// Pixels of one view, with an image that names them.
template <class Value>
struct Pixels {
    Pixels(const splat_camera& camera, std::uint32_t channels)
        : values(std::size_t{camera.width} * camera.height * channels, Value{7}) {
        image.pixels = values.data();
        image.bytes = values.size() * sizeof(Value);
        image.type = sizeof(Value) == 1 ? SPLAT_PIXEL_U8 : SPLAT_PIXEL_F32;
        image.width = camera.width;
        image.height = camera.height;
        image.channels = channels;
    }
    std::vector<Value> values;
    splat_image image{};
};

template <class Value>
using Views = std::vector<Pixels<Value>>;

template <class Value>
splat_result render(splat_device device, splat_scene scene, const splat_scene_render_desc* desc,
                    Views<Value>& to, std::uint32_t channels) {
    const std::vector<splat_camera> cameras = some_cameras();
    to.clear();
    std::vector<splat_image> images;
    for (const splat_camera& camera : cameras) to.emplace_back(camera, channels);
    for (const Pixels<Value>& view : to) images.push_back(view.image);
    return splat_scene_render(scene, device, cameras.data(),
                              static_cast<std::uint32_t>(cameras.size()), desc, images.data());
}

/// The same by rasterizers.
template <class Value>
void expect_drawn(splat_scene scene, const Views<Value>& got, std::uint32_t flags,
                  splat_convention convention, splat_output output, const float* background) {
    const std::vector<splat_camera> cameras = some_cameras();
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        splat_rasterizer_desc desc =
            rasterizer_desc(40, cameras[i].width, cameras[i].height, flags);
        desc.sh_degree = 2;
        desc.convention = convention;
        const Rasterizer rasterizer = make_rasterizer(shared_device(), desc);
        EXPECT_DONE(draw(rasterizer, scene, cameras[i], background));
        const Pixels<Value> expected(cameras[i], got[i].image.channels);
        EXPECT_DONE(
            splat_rasterizer_read_images(rasterizer, nullptr, output, 0, &expected.image, 1));
        EXPECT_EQ(got[i].values, expected.values) << "view " << i;
        EXPECT_NE(got[i].values, std::vector<Value>(got[i].values.size(), got[i].values[0]));
    }
}

TEST(ApiSceneRender, GivesTheImagesOfARasterizer) {
    const Scene scene = SampleScene(40, 2).create();
    Views<std::uint8_t> bytes;
    ASSERT_DONE(render(shared_device(), scene, nullptr, bytes, 4));
    expect_drawn(scene, bytes, 0, 0, SPLAT_OUTPUT_RGB, nullptr);
    auto desc = sized<splat_scene_render_desc>();
    desc.background[1] = 0.5F;
    desc.flags = SPLAT_RASTERIZER_ANTIALIASED;
    desc.convention = SPLAT_CONVENTION_GSPLAT;
    Views<float> floats;
    ASSERT_DONE(render(shared_device(), scene, &desc, floats, 3));
    expect_drawn(scene, floats, desc.flags, desc.convention, SPLAT_OUTPUT_RGB, desc.background);
    for (const splat_output output : {SPLAT_OUTPUT_ALPHA, SPLAT_OUTPUT_DEPTH, SPLAT_OUTPUT_NORMALS,
                                      SPLAT_OUTPUT_MEDIAN_DEPTH}) {
        desc.output = output;
        ASSERT_DONE(
            render(shared_device(), scene, &desc, floats, output == SPLAT_OUTPUT_NORMALS ? 3 : 1));
        expect_drawn(scene, floats,
                     desc.flags | SPLAT_RASTERIZER_DEPTH | SPLAT_RASTERIZER_NORMALS |
                         SPLAT_RASTERIZER_MEDIAN_DEPTH,
                     desc.convention, output, desc.background);
    }
}

TEST(ApiSceneRender, RayMaximum) {
    const Scene scene = SampleScene(40, 2).create();
    auto desc = sized<splat_scene_render_desc>();
    desc.convention = SPLAT_CONVENTION_RAY_MAXIMUM;
    Views<float> floats;
    for (const splat_output output :
         {SPLAT_OUTPUT_RGB, SPLAT_OUTPUT_EXPECTED_DEPTH, SPLAT_OUTPUT_MEDIAN_DEPTH}) {
        desc.output = output;
        ASSERT_DONE(
            render(shared_device(), scene, &desc, floats, output == SPLAT_OUTPUT_RGB ? 3 : 1));
        expect_drawn(scene, floats, SPLAT_RASTERIZER_DEPTH | SPLAT_RASTERIZER_MEDIAN_DEPTH,
                     desc.convention, output, desc.background);
    }
    desc.flags = SPLAT_RASTERIZER_ANTIALIASED;
    EXPECT_REFUSED(render(shared_device(), scene, &desc, floats, 1), kArgument,
                   "SPLAT_RASTERIZER_ANTIALIASED compensates for a dilation");
    auto wanted = rasterizer_desc(40, 16, 16, SPLAT_RASTERIZER_CONTRIBUTIONS);
    wanted.convention = SPLAT_CONVENTION_RAY_MAXIMUM;
    splat_rasterizer none = nullptr;
    EXPECT_REFUSED(splat_rasterizer_create(shared_device(), &wanted, &none), kArgument,
                   "SPLAT_CONVENTION_RAY_MAXIMUM draws without gradients");
    wanted.flags = 0;
    const Rasterizer rasterizer = make_rasterizer(shared_device(), wanted);
    const splat_camera camera = sample_camera(16, 16);
    ASSERT_DONE(draw(rasterizer, scene, camera, nullptr));
    Floats numbers(3 * 40);
    EXPECT_REFUSED(splat_rasterizer_read(rasterizer, nullptr, SPLAT_OUTPUT_CONICS, numbers.data(),
                                         numbers.size() * sizeof(float)),
                   kState, "not SPLAT_CONVENTION_RAY_MAXIMUM");
    EXPECT_DONE(splat_rasterizer_read(rasterizer, nullptr, SPLAT_OUTPUT_RADII, numbers.data(),
                                      numbers.size() * sizeof(float)));
}

/// Threads of this process, without those that Mesa's disk cache adds as it likes.
std::size_t threads() {
    std::size_t count = 0;
    for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
        std::string name;
        std::getline(std::ifstream(task.path() / "comm"), name);
        if (name.find("disk$") == std::string::npos) ++count;
    }
    return count;
}

/// The kernel lists a joined thread for a moment more.
bool threads_fall_to(std::size_t most) {
    for (int tries = 0; tries < 1000; ++tries) {
        if (threads() <= most) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
}

TEST(ApiSceneRender, OpensADeviceAndClosesIt) {
    const Scene scene = SampleScene(40, 2).create();
    Views<float> mine, own;
    ASSERT_DONE(render(shared_device(), scene, nullptr, mine, 3));
    const std::size_t before = threads();
    for (int i = 0; i < 3; ++i) {
        ASSERT_DONE(render(nullptr, scene, nullptr, own, 3));
        for (std::size_t view = 0; view < own.size(); ++view)
            EXPECT_EQ(own[view].values, mine[view].values);
        EXPECT_TRUE(threads_fall_to(before))
            << "the scene would keep the device, whose driver has threads: " << threads()
            << " threads, " << before << " before";
    }
}

TEST(ApiSceneRender, ArgumentsAreRefusedBeforeAnythingIsDrawn) {
    const Scene scene = SampleScene(40, 2).create();
    std::vector<splat_camera> cameras = some_cameras();
    Views<float> views;
    std::vector<splat_image> images;
    for (const splat_camera& camera : cameras) views.emplace_back(camera, 3);
    for (const Pixels<float>& view : views) images.push_back(view.image);
    const auto refuse = [&](splat_result code, const char* part) {
        EXPECT_REFUSED(
            splat_scene_render(scene, shared_device(), cameras.data(), 3, nullptr, images.data()),
            code, part);
        for (const Pixels<float>& view : views)
            EXPECT_EQ(view.values, Floats(view.values.size(), 7));
    };
    images[2].channels = 2;
    refuse(kShape, "images[2]");
    images[2].channels = 3;
    cameras[1].world_to_camera[3] = NAN;
    refuse(kArgument, "cameras[1]");
    cameras[1] = cameras[2];
    refuse(kShape, "images[1]");
}

TEST(ApiSceneRender, AnEmptySceneIsTheBackground) {
    const Scene scene = empty_scene();
    auto desc = sized<splat_scene_render_desc>();
    desc.background[1] = 0.5F;
    Views<float> views;
    ASSERT_DONE(render(shared_device(), scene, &desc, views, 4));
    EXPECT_EQ(views[2].values[1], 0.5F);
    EXPECT_EQ(views[2].values[3], 0);
}

}  // namespace
}  // namespace splat::test

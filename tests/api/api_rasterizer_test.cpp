// Behaviour of rasterizers. api_raster_equal_test.cpp compares what they compute.
#include <algorithm>
#include <cmath>
#include <limits>

#include "api/raster_calls.h"

namespace splat::test {
namespace {

constexpr std::uint32_t kWidth = 40;
constexpr std::uint32_t kHeight = 30;
constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight;

splat_result forward(splat_rasterizer rasterizer, splat_scene scene, double angle = 0) {
    const splat_camera camera = sample_camera(kWidth, kHeight, angle);
    return draw(rasterizer, scene, camera);
}

Floats image_of(splat_rasterizer rasterizer) {
    return output(rasterizer, SPLAT_OUTPUT_RGB, 3 * kPixels);
}

Rasterizer make(std::uint32_t gaussians, std::uint32_t flags = 0, std::uint32_t views = 0) {
    return make_rasterizer(shared_device(),
                           rasterizer_desc(gaussians, kWidth, kHeight, flags, views));
}

std::uint64_t used(splat_device device) {
    return got(splat_device_get_memory, device).live_bytes;
}

splat_result backward(splat_rasterizer rasterizer, splat_tensor grad_means) {
    auto gradients = sized<splat_gradients_desc>();
    gradients.grad_means = grad_means;
    return splat_rasterizer_backward(rasterizer, nullptr, &gradients);
}

TEST(ApiRasterizer, TensorsAndScenesGiveTheSameImage) {
    const Scene scene = SampleScene(60).create();
    const GaussianTensors tensors(shared_device(), scene);
    const Rasterizer rasterizer = make(60);
    ASSERT_DONE(forward(rasterizer, scene));
    const Floats by_scene = image_of(rasterizer);
    const splat_camera camera = sample_camera(kWidth, kHeight);
    const splat_gaussians_desc desc = tensors.desc();
    ASSERT_DONE(draw(rasterizer, desc, camera));
    EXPECT_EQ(image_of(rasterizer), by_scene);
    EXPECT_NE(by_scene, Floats(3 * kPixels)) << "something is there";
}

TEST(ApiRasterizer, ViewsAreDrawnTogetherAsOneByOne) {
    const Scene scene = SampleScene(60).create();
    const Rasterizer one = make(60), three = make(60, 0, 3);
    const splat_camera cameras[] = {sample_camera(kWidth, kHeight, 0),
                                    sample_camera(kWidth, kHeight, 1),
                                    sample_camera(kWidth, kHeight, 2)};
    const float background[] = {0.25F, 0.5F, 0.75F};
    ASSERT_DONE(splat_rasterizer_forward_scene(three, nullptr, scene, cameras, 3, background));
    const Floats all = output(three, SPLAT_OUTPUT_RGB, 9 * kPixels);
    for (std::size_t view = 0; view < 3; ++view) {
        ASSERT_DONE(draw(one, scene, cameras[view], background));
        const auto first = all.begin() + static_cast<std::ptrdiff_t>(view * 3 * kPixels);
        EXPECT_EQ(image_of(one), Floats(first, first + 3 * kPixels)) << view;
    }
}

TEST(ApiRasterizer, SeesChangesOfItsScene) {
    const Scene scene = SampleScene(60).create();
    const Rasterizer rasterizer = make(60);
    ASSERT_DONE(forward(rasterizer, scene));
    const Floats before = image_of(rasterizer);
    const splat_similarity moved = {{1, 0, 0, 0}, {0.3, 0, 0}, 1};
    ASSERT_DONE(splat_scene_transform(scene, &moved));
    ASSERT_DONE(forward(rasterizer, scene));
    EXPECT_NE(image_of(rasterizer), before);
    const splat_similarity back = {{1, 0, 0, 0}, {-0.3, 0, 0}, 1};
    const SampleScene sample(60);
    ASSERT_DONE(splat_scene_transform(scene, &back));
    ASSERT_DONE(splat_scene_write(scene, "means", sample.means.data(), 60 * 12));
    ASSERT_DONE(forward(rasterizer, scene));
    EXPECT_EQ(image_of(rasterizer), before);
    const double low[3] = {-0.2, -9, -9};
    const double high[3] = {9, 9, 9};
    ASSERT_DONE(splat_scene_crop(scene, low, high));
    ASSERT_DONE(forward(rasterizer, scene));
    EXPECT_NE(image_of(rasterizer), before) << "fewer Gaussians than it was made for";
    ASSERT_DONE(forward(rasterizer, sample.create()));
    EXPECT_REFUSED(forward(rasterizer, SampleScene(61).create()), kArgument,
                   "was made for at most 60");
    EXPECT_EQ(image_of(rasterizer), before) << "refused at once: the last image stays";
}

TEST(ApiRasterizer, BandsAreLeftOutOrPadded) {
    SampleScene sample(40, 2);
    const Scene scene = sample.create();
    std::vector<Floats> images;
    for (const std::uint32_t degree : {0U, 2U, 3U}) {
        splat_rasterizer_desc desc = rasterizer_desc(40, kWidth, kHeight);
        desc.sh_degree = degree;
        const Rasterizer rasterizer = make_rasterizer(shared_device(), desc);
        ASSERT_DONE(forward(rasterizer, scene));
        images.push_back(image_of(rasterizer));
    }
    EXPECT_NE(images[0], images[1]);
    EXPECT_EQ(images[2], images[1]) << "bands that the scene lacks are not evaluated";
}

TEST(ApiRasterizer, NothingGivesTheBackground) {
    const Scene scene = empty_scene();
    const Rasterizer rasterizer = make(0);
    const splat_camera camera = sample_camera(kWidth, kHeight);
    const float background[] = {0.5F, 0.25F, 1};
    const auto tensors = sized<splat_gaussians_desc>();
    for (int way = 0; way < 2; ++way) {
        if (way == 0)
            ASSERT_DONE(draw(rasterizer, scene, camera, background));
        else
            ASSERT_DONE(draw(rasterizer, tensors, camera, background));
        const Floats image = image_of(rasterizer);
        for (std::size_t i = 0; i < image.size(); ++i) EXPECT_EQ(image[i], background[i % 3]);
        EXPECT_EQ(output(rasterizer, SPLAT_OUTPUT_ALPHA, kPixels), Floats(kPixels));
    }
}

/// The calls of one forward pass and its gradient.
struct Pass {
    Floats image, alpha, grad_means, grad_sh;

    friend bool operator==(const Pass&, const Pass&) = default;
};

/// Reads what a state drew and computes the gradient of the sum of its colours.
Pass finish(splat_rasterizer rasterizer, splat_raster_state state) {
    const auto info = got(splat_rasterizer_get_info, rasterizer, state);
    const std::int64_t n = info.gaussians;
    const std::size_t pixels = info.views * kPixels;
    Pass pass;
    pass.image = output(rasterizer, SPLAT_OUTPUT_RGB, 3 * pixels, state);
    pass.alpha = output(rasterizer, SPLAT_OUTPUT_ALPHA, pixels, state);
    const Tensor ones =
        upload(shared_device(), {info.views, kHeight, kWidth, 3}, Floats(3 * pixels, 1.0F));
    const Tensor means = make_tensor(shared_device(), {n, 3});
    const Tensor sh = make_tensor(shared_device(), {n, 4, 3});
    auto gradients = sized<splat_gradients_desc>();
    gradients.grad_rgb = ones;
    gradients.grad_means = means;
    gradients.grad_sh = sh;
    EXPECT_DONE(splat_rasterizer_backward(rasterizer, state, &gradients));
    pass.grad_means = download(means);
    pass.grad_sh = download(sh);
    return pass;
}

/// A = forward, B = forward, backward of A, backward of B, where B has fewer Gaussians and views.
TEST(ApiRasterizer, StatesKeepTheirForwardCalls) {
    const Rasterizer rasterizer = make(60, SPLAT_RASTERIZER_BACKWARD, 2);
    const Scene large = SampleScene(60).create();
    const Scene small = SampleScene(35).create();
    const splat_camera cameras[] = {sample_camera(kWidth, kHeight, 0),
                                    sample_camera(kWidth, kHeight, 1)};
    const auto draw_large = [&](splat_raster_state state) {
        EXPECT_DONE(splat_rasterizer_forward_scene(rasterizer, state, large, cameras, 2, nullptr));
    };
    const auto draw_small = [&](splat_raster_state state) {
        const GaussianTensors tensors(shared_device(), small);
        const splat_gaussians_desc given = tensors.desc();
        EXPECT_DONE(splat_rasterizer_forward(rasterizer, state, &given, cameras, 1, nullptr));
    };
    draw_large(nullptr);
    const Pass first = finish(rasterizer, nullptr);
    draw_small(nullptr);
    const Pass second = finish(rasterizer, nullptr);
    EXPECT_NE(first.grad_means, Floats(180));
    const RasterState a = make_state(rasterizer);
    const RasterState b = make_state(rasterizer);
    draw_large(a);
    draw_small(b);
    EXPECT_TRUE(finish(rasterizer, a) == first);
    EXPECT_TRUE(finish(rasterizer, b) == second);
    EXPECT_TRUE(finish(rasterizer, a) == first) << "in any order, again";
    EXPECT_TRUE(finish(rasterizer, nullptr) == second) << "the rasterizer's own state";
    const Rasterizer exact = make(35, SPLAT_RASTERIZER_BACKWARD);
    ASSERT_DONE(splat_rasterizer_forward_scene(exact, nullptr, small, cameras, 1, nullptr));
    EXPECT_TRUE(finish(exact, nullptr) == second) << "capacities do not change a bit";
}

TEST(ApiRasterizer, MemoryOfStatesCounts) {
    const Device device = open_device();
    Rasterizer rasterizer =
        make_rasterizer(device, rasterizer_desc(60, kWidth, kHeight, SPLAT_RASTERIZER_BACKWARD));
    const std::uint64_t before = used(device);
    RasterState state = make_state(rasterizer);
    const std::uint64_t with_state = used(device);
    EXPECT_GT(with_state, before);
    EXPECT_LT(with_state - before, before) << "gradients are shared";
    rasterizer.destroy();
    EXPECT_GT(used(device), 0U) << "the state keeps what it needs";
    state.destroy();
    EXPECT_EQ(used(device), 0U);
}

/// A state holds the copy of the scene that it drew last, and no other.
TEST(ApiRasterizer, MemoryOfScenesIsFreed) {
    const Device device = open_device();
    Scene scene = SampleScene(60).create();
    const GaussianTensors tensors(device, scene);
    const Rasterizer rasterizer = make_rasterizer(device, rasterizer_desc(60, kWidth, kHeight));
    const splat_camera camera = sample_camera(kWidth, kHeight);
    const splat_gaussians_desc desc = tensors.desc();
    ASSERT_DONE(draw(rasterizer, desc, camera));
    const std::uint64_t before = used(device);
    ASSERT_DONE(forward(rasterizer, scene));
    EXPECT_GT(used(device), before);
    scene.destroy();
    EXPECT_GT(used(device), before) << "backward may need it";
    ASSERT_DONE(draw(rasterizer, desc, camera));
    EXPECT_EQ(used(device), before);
}

/// Every Gaussian is counted once: visible, culled, or not finite in any of its numbers.
TEST(ApiRasterizer, CountsWhatIsDrawnAndWhatIsNot) {
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    constexpr float kInfinite = std::numeric_limits<float>::infinity();
    constexpr std::size_t kCount = 60;
    const Scene scene = SampleScene(kCount).create();
    const GaussianTensors tensors(shared_device(), scene);
    const Rasterizer rasterizer = make(kCount);
    const splat_camera camera = sample_camera(kWidth, kHeight);
    const auto draw = [&] {
        EXPECT_DONE(test::draw(rasterizer, tensors.desc(), camera));
        const auto info = got(splat_rasterizer_get_info, rasterizer, nullptr);
        EXPECT_EQ(info.visible + info.culled + info.non_finite, kCount);
        return info;
    };
    const auto change = [](const Tensor& tensor, std::size_t at, float value) {
        Floats values = download(tensor);
        values[at] = value;
        write(tensor, values);
    };
    const splat_rasterizer_info whole = draw();
    EXPECT_EQ(whole.non_finite, 0U);
    const Floats seen = output(rasterizer, SPLAT_OUTPUT_VISIBILITY, kCount);
    ASSERT_EQ(Floats(seen.begin(), seen.begin() + 7), Floats(7, 1.0F));
    change(tensors.means, 2, -100);  // behind the camera
    EXPECT_EQ(draw().non_finite, 0U);
    EXPECT_EQ(draw().culled, whole.culled + 1);
    change(tensors.means, 3, kNan);
    change(tensors.scales, 6, kInfinite);
    change(tensors.rotations, 12, kNan);
    change(tensors.opacities, 4, kInfinite);
    change(tensors.sh, 5 * 4 * 3, kNan);
    change(tensors.scales, 18, 1e30F);  // the square is infinite
    EXPECT_EQ(draw().non_finite, 6U);
    EXPECT_EQ(draw().culled, whole.culled + 1);
    EXPECT_EQ(draw().visible, whole.visible - 7);
}

TEST(ApiRasterizer, NoViews) {
    const Scene scene = SampleScene(60).create();
    const Rasterizer rasterizer = make(60, SPLAT_RASTERIZER_BACKWARD);
    ASSERT_DONE(splat_rasterizer_forward_scene(rasterizer, nullptr, scene, nullptr, 0, nullptr));
    const auto info = got(splat_rasterizer_get_info, rasterizer, nullptr);
    EXPECT_EQ(info.gaussians, 60U);
    EXPECT_EQ(info.views, 0U);
    EXPECT_EQ(info.tiles, 0U);
    EXPECT_DONE(splat_rasterizer_read(rasterizer, nullptr, SPLAT_OUTPUT_RGB, nullptr, 0));
    const Tensor means = upload(shared_device(), {60, 3}, Floats(180, 7.0F));
    ASSERT_DONE(backward(rasterizer, means));
    EXPECT_EQ(download(means), Floats(180));
}

/// Pictures have the numbers of the outputs, and bytes are those that splat_image_save writes.
TEST(ApiRasterizer, ReadsPictures) {
    const Scene scene = SampleScene(60).create();
    const Rasterizer rasterizer = make(60, SPLAT_RASTERIZER_DEPTH, 2);
    const splat_camera cameras[] = {sample_camera(kWidth, kHeight, 0),
                                    sample_camera(kWidth, kHeight, 1)};
    const float background[3] = {1.25F, 0.5F, -1};
    ASSERT_DONE(splat_rasterizer_forward_scene(rasterizer, nullptr, scene, cameras, 2, background));
    const Floats rgb = output(rasterizer, SPLAT_OUTPUT_RGB, 6 * kPixels);
    const Floats alpha = output(rasterizer, SPLAT_OUTPUT_ALPHA, 2 * kPixels);
    const Floats depth = output(rasterizer, SPLAT_OUTPUT_EXPECTED_DEPTH, 2 * kPixels);
    std::vector<std::uint8_t> bytes(4 * kPixels);
    Floats planes(4 * kPixels), gray(kPixels);
    constexpr std::int64_t kPlane = 4 * kPixels;
    const splat_image images[] = {
        {bytes.data(), bytes.size(), SPLAT_PIXEL_U8, kWidth, kHeight, 4, 0, 0, 0},
        {planes.data(), 16 * kPixels, SPLAT_PIXEL_F32, kWidth, kHeight, 4, 4 * kWidth, 4, kPlane}};
    const auto read = [&](splat_output which, std::uint32_t first, const splat_image* to,
                          std::uint32_t count) {
        return splat_rasterizer_read_images(rasterizer, nullptr, which, first, to, count);
    };
    ASSERT_DONE(read(SPLAT_OUTPUT_RGB, 0, images, 2));
    const splat_image of_depth = {
        gray.data(), 4 * kPixels, SPLAT_PIXEL_F32, kWidth, kHeight, 1, 0, 0, 0};
    ASSERT_DONE(read(SPLAT_OUTPUT_EXPECTED_DEPTH, 1, &of_depth, 1));
    for (std::size_t i = 0; i < kPixels; ++i) {
        for (std::size_t c = 0; c < 4; ++c) {
            const float first = c == 3 ? alpha[i] : rgb[3 * i + c];
            const double scaled = 255 * static_cast<double>(first);
            EXPECT_EQ(bytes[4 * i + c], std::lround(std::clamp(scaled, 0.0, 255.0))) << i;
            const float second = c == 3 ? alpha[kPixels + i] : rgb[3 * (kPixels + i) + c];
            EXPECT_EQ(planes[c * kPixels + i], second) << i;
        }
        EXPECT_EQ(gray[i], depth[kPixels + i]) << i;
    }
    EXPECT_REFUSED(read(SPLAT_OUTPUT_RGB, 1, images, 2), kArgument,
                   "views 1 to 3, but the last forward call drew 2");
    EXPECT_REFUSED(read(SPLAT_OUTPUT_ALPHA, 0, images, 1), kShape, "images[0]");
    EXPECT_DONE(read(SPLAT_OUTPUT_RGB, 2, nullptr, 0));
}

/// Objects may be destroyed in any order.
TEST(ApiRasterizer, OutlivesSceneAndDevice) {
    Device device = open_device();
    Scene scene = SampleScene(30).create();
    Rasterizer rasterizer =
        make_rasterizer(device, rasterizer_desc(30, kWidth, kHeight, SPLAT_RASTERIZER_BACKWARD));
    ASSERT_DONE(forward(rasterizer, scene));
    const Floats image = image_of(rasterizer);
    const Tensor grad = make_tensor(device, {30, 3});
    scene.destroy();
    device.destroy();
    EXPECT_EQ(image_of(rasterizer), image);
    EXPECT_DONE(backward(rasterizer, grad));
    EXPECT_EQ(download(grad), Floats(90)) << "no gradient by the outputs: zeros";
}

TEST(ApiRasterizer, ScenesFollowEachOther) {
    const Rasterizer rasterizer = make(30);
    Floats first;
    for (int turn = 0; turn < 3; ++turn) {
        const Scene scene = SampleScene(30).create();
        ASSERT_DONE(forward(rasterizer, scene));
        if (turn == 0) first = image_of(rasterizer);
        EXPECT_EQ(image_of(rasterizer), first);
    }
}

TEST(ApiRasterizer, RefusesTensorsThatDoNotFit) {
    const Scene scene = SampleScene(8).create();
    const GaussianTensors good(shared_device(), scene);
    const Rasterizer rasterizer = make(8);
    const splat_camera camera = sample_camera(kWidth, kHeight);
    const auto refuse = [&](const splat_gaussians_desc& desc, splat_result code, const char* part) {
        EXPECT_REFUSED(draw(rasterizer, desc, camera), code, part);
    };
    const Tensor short_one = make_tensor(shared_device(), {7, 3});
    const Tensor words = make_tensor(shared_device(), {8, 3}, "words", SPLAT_DTYPE_U32);
    const Device other = open_device();
    const Tensor far_away = make_tensor(other, {8, 3});
    splat_gaussians_desc desc = good.desc();
    desc.means = short_one;
    refuse(desc, kShape, "scales has the shape [8, 3], expected [7, 3]");
    desc.means = make_tensor(shared_device(), {9, 3}).destroy();
    refuse(desc, kHandle, "means");
    const Tensor long_one = make_tensor(shared_device(), {9, 3});
    desc.means = long_one;
    refuse(desc, kShape, "made for at most 8 Gaussians");
    desc = good.desc();
    desc.scales = short_one;
    refuse(desc, kShape, "scales has the shape [7, 3], expected [8, 3]");
    desc.means = words;
    refuse(desc, kArgument, "means has dtype 3");
    desc.means = far_away;
    refuse(desc, kArgument, "another device than the rasterizer");
    desc.means = reinterpret_cast<splat_tensor>(scene.get());
    refuse(desc, kHandle, "splat_scene");
    desc = good.desc();
    desc.colors = good.means;
    refuse(desc, kArgument, "colors is not NULL");
    desc = good.desc();
    desc.sh = nullptr;
    refuse(desc, kArgument, "sh is NULL");
    mapped(good.scales, SPLAT_ACCESS_READ);
    refuse(good.desc(), kState, "is mapped");
    ASSERT_DONE(splat_tensor_unmap(good.scales));
    EXPECT_DONE(draw(rasterizer, good.desc(), camera));
}

TEST(ApiRasterizer, RefusesWhatItWasNotMadeFor) {
    const Scene scene = SampleScene(8).create();
    const Rasterizer plain = make(8);
    Floats values(kPixels, 7);
    for (const std::size_t bytes : {kPixels * 4, std::size_t{4}, std::size_t{0}})
        EXPECT_REFUSED(
            splat_rasterizer_read(plain, nullptr, SPLAT_OUTPUT_ALPHA, values.data(), bytes), kState,
            "drawn nothing");
    const Tensor one = make_tensor(shared_device(), {1});
    EXPECT_REFUSED(splat_rasterizer_output(plain, nullptr, SPLAT_OUTPUT_ALPHA, one), kState,
                   "drawn nothing");
    const splat_image image = planes_image(values.data(), 1);
    EXPECT_REFUSED(splat_rasterizer_read_images(plain, nullptr, SPLAT_OUTPUT_RGB, 0, &image, 1),
                   kState, "drawn nothing");
    ASSERT_DONE(forward(plain, scene));
    EXPECT_REFUSED(
        splat_rasterizer_read(plain, nullptr, SPLAT_OUTPUT_DEPTH, values.data(), kPixels * 4),
        kState, "SPLAT_RASTERIZER_DEPTH");
    EXPECT_EQ(values, Floats(kPixels, 7)) << "untouched";
    const Tensor means = make_tensor(shared_device(), {8, 3});
    EXPECT_REFUSED(backward(plain, means), kState, "SPLAT_RASTERIZER_BACKWARD");
    const Rasterizer rasterizer = make(8, SPLAT_RASTERIZER_BACKWARD);
    for (const splat_tensor tensor : {means.get(), one.get()})
        EXPECT_REFUSED(backward(rasterizer, tensor), kState, "drawn nothing");
    ASSERT_DONE(forward(rasterizer, scene));
    const Tensor depth = make_tensor(shared_device(), {1, kHeight, kWidth});
    const Tensor any = make_tensor(shared_device(), {8, 3});
    const auto refuse = [&](splat_tensor splat_gradients_desc::*field, splat_tensor tensor,
                            splat_result code, const char* part) {
        auto desc = sized<splat_gradients_desc>();
        desc.grad_means = means;
        desc.*field = tensor;
        EXPECT_REFUSED(splat_rasterizer_backward(rasterizer, nullptr, &desc), code, part);
    };
    refuse(&splat_gradients_desc::grad_depth, depth, kState, "SPLAT_RASTERIZER_GRAD_DEPTH");
    refuse(&splat_gradients_desc::grad_world_to_camera, any, kState, "SPLAT_RASTERIZER_GRAD_POSE");
    refuse(&splat_gradients_desc::grad_means2d, any, kState, "SPLAT_RASTERIZER_GRAD_MEANS2D");
    refuse(&splat_gradients_desc::grad_means2d_abs, any, kState, "GRAD_MEANS2D");
    refuse(&splat_gradients_desc::grad_colors, any, kState, "DIRECT_COLORS");
    refuse(&splat_gradients_desc::grad_scales, means, kArgument,
           "grad_scales is the same tensor as grad_means");
    refuse(&splat_gradients_desc::grad_rotations, any, kShape, "[8, 4]");
    EXPECT_DONE(backward(rasterizer, means));
    const Rasterizer direct = make(8, SPLAT_RASTERIZER_DIRECT_COLORS);
    EXPECT_REFUSED(forward(direct, scene), kState, "direct colours");
}

TEST(ApiRasterizer, MemoryBeyondTheBudgetIsRefused) {
    splat_device_desc desc = device_desc();
    desc.max_device_bytes = std::uint64_t{48} << 20;
    const Device device = open_device(desc);
    const splat_rasterizer_desc large = rasterizer_desc(100, 2048, 2048);
    Output<splat_rasterizer> out;
    EXPECT_REFUSED(splat_rasterizer_create(device, &large, out.out()),
                   SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, "");
    EXPECT_TRUE(out.untouched());
    const Rasterizer small = make_rasterizer(device, rasterizer_desc(8, kWidth, kHeight));
    EXPECT_DONE(forward(small, SampleScene(8).create()));
}

}  // namespace
}  // namespace splat::test

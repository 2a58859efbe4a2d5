// Rasterizers that take any number of views, of any size up to their own.
#include <algorithm>

#include "api/raster_calls.h"

namespace splat::test {
namespace {

constexpr std::uint32_t kSide = 24;
constexpr std::size_t kPixels = std::size_t{kSide} * kSide;
constexpr std::uint32_t kCount = 60;
constexpr std::uint32_t kFlags = SPLAT_RASTERIZER_GRAD_MEANS2D | SPLAT_RASTERIZER_GRAD_DEPTH;

std::vector<splat_camera> cameras_around(std::uint32_t count) {
    std::vector<splat_camera> cameras;
    for (std::uint32_t i = 0; i < count; ++i)
        cameras.push_back(sample_camera(kSide, kSide, 0.7 * i));
    return cameras;
}

splat_result draw(splat_rasterizer rasterizer, splat_raster_state state, splat_scene scene,
                  std::uint32_t views) {
    return splat_rasterizer_forward_scene(rasterizer, state, scene, cameras_around(views).data(),
                                          views, nullptr);
}

Floats drawn(splat_rasterizer rasterizer, splat_raster_state state, std::uint32_t views) {
    return output(rasterizer, SPLAT_OUTPUT_RGB, 3 * kPixels * views, state);
}

/// Gradients of the sum of all colours and depths.
Floats gradients(splat_rasterizer rasterizer, splat_raster_state state, std::uint32_t views) {
    const Dims image = {views, kSide, kSide};
    const Tensor rgb =
        upload(shared_device(), {views, kSide, kSide, 3}, Floats(3 * kPixels * views, 1));
    const Tensor depth = upload(shared_device(), image, Floats(kPixels * views, 1));
    const Tensor means = make_tensor(shared_device(), {kCount, 3});
    const Tensor means2d = make_tensor(shared_device(), {views, kCount, 2});
    auto desc = sized<splat_gradients_desc>();
    desc.grad_rgb = rgb;
    desc.grad_depth = depth;
    desc.grad_means = means;
    desc.grad_means2d = means2d;
    EXPECT_DONE(splat_rasterizer_backward(rasterizer, state, &desc));
    Floats all = download(means);
    const Floats more = download(means2d);
    all.insert(all.end(), more.begin(), more.end());
    return all;
}

/// Image and gradients of a rasterizer made for exactly so many views.
std::pair<Floats, Floats> exact(splat_scene scene, std::uint32_t views) {
    const Rasterizer made =
        make_rasterizer(shared_device(), rasterizer_desc(kCount, kSide, kSide, kFlags, views));
    EXPECT_DONE(draw(made, nullptr, scene, views));
    return {drawn(made, nullptr, views), gradients(made, nullptr, views)};
}

TEST(ApiRasterViews, AnyNumberHasTheBitsOfExactlySoMany) {
    const Scene scene = SampleScene(kCount).create();
    const Rasterizer any =
        make_rasterizer(shared_device(), rasterizer_desc(kCount, kSide, kSide, kFlags));
    auto info = sized<splat_rasterizer_info>();
    std::uint64_t bytes = 0;
    for (const std::uint32_t views : {1U, 4U, 2U, 5U}) {
        ASSERT_DONE(draw(any, nullptr, scene, views));
        const auto [image, gradient] = exact(scene, views);
        EXPECT_EQ(drawn(any, nullptr, views), image) << views;
        EXPECT_EQ(gradients(any, nullptr, views), gradient) << views;
        ASSERT_DONE(splat_rasterizer_get_info(any, nullptr, &info));
        EXPECT_EQ(info.views, views);
        if (views == 2)
            EXPECT_EQ(info.bytes, bytes) << "the memory stays";
        else
            EXPECT_GT(info.bytes, bytes);
        bytes = info.bytes;
    }
}

TEST(ApiRasterViews, TensorsAreDrawnFromAnyNumber) {
    const Scene scene = SampleScene(kCount).create();
    const GaussianTensors tensors(shared_device(), scene);
    const splat_gaussians_desc desc = tensors.desc();
    const Rasterizer any =
        make_rasterizer(shared_device(), rasterizer_desc(kCount, kSide, kSide, kFlags));
    for (const std::uint32_t views : {3U, 1U, 4U}) {
        ASSERT_DONE(splat_rasterizer_forward(any, nullptr, &desc, cameras_around(views).data(),
                                             views, nullptr));
        EXPECT_EQ(drawn(any, nullptr, views), exact(scene, views).first) << views;
    }
}

/// States share the memory of gradients, which one of them makes anew.
TEST(ApiRasterViews, StatesGrowByThemselves) {
    const Scene scene = SampleScene(kCount).create();
    const Rasterizer any =
        make_rasterizer(shared_device(), rasterizer_desc(kCount, kSide, kSide, kFlags));
    const RasterState state = make_state(any);
    ASSERT_DONE(draw(any, nullptr, scene, 2));
    const Floats two = gradients(any, nullptr, 2);
    ASSERT_DONE(draw(any, state, scene, 5));
    EXPECT_EQ(gradients(any, state, 5), exact(scene, 5).second);
    EXPECT_EQ(drawn(any, nullptr, 2), exact(scene, 2).first) << "the other state stays";
    EXPECT_EQ(gradients(any, nullptr, 2), two);
}

TEST(ApiRasterViews, LimitsHoldAndLeaveTheLastImages) {
    const Scene scene = SampleScene(kCount).create();
    splat_device_desc small = device_desc();
    small.max_device_bytes = std::uint64_t{12} << 20;
    const Device device = open_device(small);
    const Rasterizer any = make_rasterizer(device, rasterizer_desc(kCount, kSide, kSide));
    ASSERT_DONE(draw(any, nullptr, scene, 1));
    const Floats before = drawn(any, nullptr, 1);
    EXPECT_REFUSED(draw(any, nullptr, scene, 2000), SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, "");
    EXPECT_EQ(drawn(any, nullptr, 1), before);
    EXPECT_REFUSED(draw(any, nullptr, scene, 20000), kUnsupported, "render fewer views per call");
    EXPECT_EQ(drawn(any, nullptr, 1), before);
    const Rasterizer two = make_rasterizer(device, rasterizer_desc(kCount, kSide, kSide, 0, 2));
    EXPECT_REFUSED(draw(two, nullptr, scene, 3), kArgument, "was made for at most 2 views");
}

/// Every output by pixel of a view, cut to its size.
Floats cut(const Floats& all, std::uint32_t view, std::uint32_t width, std::uint32_t height,
           std::size_t channels) {
    Floats part;
    for (std::uint32_t row = 0; row < height; ++row) {
        const auto first = static_cast<std::ptrdiff_t>((view * kPixels + row * kSide) * channels);
        const auto last = first + static_cast<std::ptrdiff_t>(width * channels);
        part.insert(part.end(), all.begin() + first, all.begin() + last);
    }
    return part;
}

constexpr std::uint32_t kFitting =
    SPLAT_RASTERIZER_GRAD_INTRINSICS | SPLAT_RASTERIZER_IDS | SPLAT_RASTERIZER_CONTRIBUTIONS;

/// Gradients of the sum of all colours [W,H,3] of one view: of the intrinsics, then contributions.
Floats fitting_gradients(splat_rasterizer rasterizer, std::uint32_t width, std::uint32_t height) {
    const Tensor rgb =
        upload(shared_device(), {1, height, width, 3}, Floats(std::size_t{3} * width * height, 1));
    const Tensor intrinsics = make_tensor(shared_device(), {1, 4});
    const Tensor contributions = make_tensor(shared_device(), {kCount, 2});
    auto desc = sized<splat_gradients_desc>();
    desc.grad_rgb = rgb;
    desc.grad_intrinsics = intrinsics;
    desc.contributions = contributions;
    EXPECT_DONE(splat_rasterizer_backward(rasterizer, nullptr, &desc));
    Floats all = download(intrinsics);
    const Floats more = download(contributions);
    all.insert(all.end(), more.begin(), more.end());
    return all;
}

splat_rasterizer_desc fitting_desc(std::uint32_t width, std::uint32_t height) {
    auto desc = rasterizer_desc(kCount, width, height, kFitting);
    desc.convention = SPLAT_CONVENTION_GSPLAT;
    return desc;
}

TEST(ApiRasterViews, SmallerCamerasHaveTheBitsOfTheirSize) {
    const Scene scene = SampleScene(kCount).create();
    const Rasterizer large = make_rasterizer(shared_device(), fitting_desc(kSide, kSide));
    const std::vector<splat_camera> cameras = {
        sample_camera(kSide, kSide), sample_camera(19, kSide, 0.7), sample_camera(kSide, 13, 1.4)};
    ASSERT_DONE(splat_rasterizer_forward_scene(large, nullptr, scene, cameras.data(), 3, nullptr));
    const Floats rgb = drawn(large, nullptr, 3);
    const Floats ids = output(large, SPLAT_OUTPUT_IDS, 3 * kPixels);
    for (std::uint32_t v = 0; v < 3; ++v) {
        const std::uint32_t w = cameras[v].width, h = cameras[v].height;
        const std::size_t pixels = std::size_t{w} * h;
        const Rasterizer exact_one = make_rasterizer(shared_device(), fitting_desc(w, h));
        ASSERT_DONE(draw(exact_one, scene, cameras[v]));
        EXPECT_EQ(cut(rgb, v, w, h, 3), output(exact_one, SPLAT_OUTPUT_RGB, 3 * pixels)) << v;
        const Floats numbers = output(exact_one, SPLAT_OUTPUT_IDS, pixels);
        EXPECT_EQ(cut(ids, v, w, h, 1), numbers) << v;
        EXPECT_GT(*std::max_element(numbers.begin(), numbers.end()), 0);
        const Floats expected = fitting_gradients(exact_one, w, h);
        EXPECT_NE(expected[0], 0);
        EXPECT_GT(*std::max_element(expected.begin() + 4, expected.end()), 1);
        ASSERT_DONE(draw(large, scene, cameras[v]));
        EXPECT_EQ(fitting_gradients(large, kSide, kSide), expected) << v;
    }
    const splat_camera wide = sample_camera(kSide + 1, kSide);
    EXPECT_REFUSED(draw(large, scene, wide), kArgument, "made for at most 24 x 24");
}

TEST(ApiRasterViews, TilesThatAreOffAreBackground) {
    const Scene scene = SampleScene(kCount).create();
    const GaussianTensors tensors(shared_device(), scene);
    const Rasterizer rasterizer = make_rasterizer(shared_device(), fitting_desc(kSide, kSide));
    splat_gaussians_desc desc = tensors.desc();
    const splat_camera camera = sample_camera(kSide, kSide);
    ASSERT_DONE(draw(rasterizer, desc, camera));
    const Floats whole = output(rasterizer, SPLAT_OUTPUT_ALPHA, kPixels);
    const std::uint8_t tiles[] = {1, 0, 0, 1};
    desc.active_tiles = tiles;
    desc.active_tile_count = 4;
    ASSERT_DONE(draw(rasterizer, desc, camera));
    const Floats part = output(rasterizer, SPLAT_OUTPUT_ALPHA, kPixels);
    for (std::size_t p = 0; p < kPixels; ++p) {
        const bool on = tiles[p / kSide / 16 * 2 + p % kSide / 16] != 0;
        ASSERT_EQ(part[p], on ? whole[p] : 0) << p;
    }
    desc.active_tile_count = 3;
    EXPECT_REFUSED(draw(rasterizer, desc, camera), kArgument, "a mask of 3 tiles, expected 4");
}

TEST(ApiRasterViews, WhatARasterizerWasNotMadeForIsRefused) {
    const Scene scene = SampleScene(kCount).create();
    const Rasterizer rasterizer =
        make_rasterizer(shared_device(), rasterizer_desc(kCount, kSide, kSide, kFlags));
    ASSERT_DONE(draw(rasterizer, nullptr, scene, 1));
    Floats ids(kPixels);
    EXPECT_REFUSED(splat_rasterizer_read(rasterizer, nullptr, SPLAT_OUTPUT_IDS, ids.data(),
                                         ids.size() * sizeof(float)),
                   kState, "SPLAT_RASTERIZER_IDS");
    EXPECT_REFUSED(splat_rasterizer_read(rasterizer, nullptr, SPLAT_OUTPUT_MEDIAN_DEPTH, ids.data(),
                                         ids.size() * sizeof(float)),
                   kState, "SPLAT_RASTERIZER_MEDIAN_DEPTH");
    const Tensor four = make_tensor(shared_device(), {1, 4});
    auto desc = sized<splat_gradients_desc>();
    desc.grad_intrinsics = four;
    EXPECT_REFUSED(splat_rasterizer_backward(rasterizer, nullptr, &desc), kState,
                   "SPLAT_RASTERIZER_GRAD_INTRINSICS");
    desc.grad_intrinsics = nullptr;
    desc.contributions = four;
    EXPECT_REFUSED(splat_rasterizer_backward(rasterizer, nullptr, &desc), kState,
                   "SPLAT_RASTERIZER_CONTRIBUTIONS");
}

}  // namespace
}  // namespace splat::test

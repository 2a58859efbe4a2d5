// Rasterizers that take any number of views.
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

}  // namespace
}  // namespace splat::test

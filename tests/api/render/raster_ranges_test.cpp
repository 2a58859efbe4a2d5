// Views that see ranges of a set, as tensors and as a scene.
#include <algorithm>

#include "api/raster_calls.h"

namespace splat::test {
namespace {

constexpr std::uint32_t kSize = 24;
constexpr std::size_t kAll = std::size_t{kSize} * kSize;
constexpr std::uint32_t kSet = 60;
constexpr std::uint32_t kWanted =
    SPLAT_RASTERIZER_GRAD_MEANS2D | SPLAT_RASTERIZER_IDS | SPLAT_RASTERIZER_CONTRIBUTIONS;
using Numbers = std::vector<std::uint32_t>;
/// Three views of two objects.
const Numbers kThree = {25, 35, 0, 25, 25, 35};

SampleScene sample_part(std::uint32_t first, std::uint32_t count) {
    SampleScene part(kSet);
    const auto cut = [&](Floats& values) {
        const std::size_t each = values.size() / kSet;
        values = Floats(&values[first * each], &values[first * each] + count * each);
    };
    for (Floats* values : {&part.means, &part.log_scales, &part.rotations, &part.sh}) cut(*values);
    cut(part.opacity_logits);
    return part;
}

std::vector<splat_camera> cameras_of(std::uint32_t count) {
    std::vector<splat_camera> cameras;
    for (std::uint32_t i = 0; i < count; ++i)
        cameras.push_back(sample_camera(kSize, kSize, 0.6 * i));
    return cameras;
}

splat_gaussians_desc with_ranges(splat_gaussians_desc desc, const Numbers& ranges) {
    desc.view_ranges = ranges.data();
    desc.view_range_count = ranges.size();
    return desc;
}

splat_gaussians_desc of_scene(splat_scene scene, const Numbers& ranges) {
    auto desc = sized<splat_gaussians_desc>();
    desc.scene = scene;
    return with_ranges(desc, ranges);
}

splat_result draw_all(splat_rasterizer rasterizer, const splat_gaussians_desc& desc,
                      std::uint32_t views = 3) {
    return splat_rasterizer_forward(rasterizer, nullptr, &desc, cameras_of(views).data(), views,
                                    nullptr);
}

/// What a backward call of the sum of all colours gives, by `items` (Gaussian, view) pairs and `n` Gaussians.
struct Sums {
    Floats means2d, means, contributions;
};

Sums sums_of(splat_rasterizer rasterizer, std::uint32_t views, Dims means2d, std::uint32_t n) {
    const Tensor rgb =
        upload(shared_device(), {views, kSize, kSize, 3}, Floats(3 * kAll * views, 1));
    const Tensor made = make_tensor(shared_device(), means2d),
                 means = make_tensor(shared_device(), {n, 3});
    const Tensor contributions = make_tensor(shared_device(), {n, 2});
    auto desc = sized<splat_gradients_desc>();
    desc.grad_rgb = rgb;
    desc.grad_means = means;
    desc.grad_means2d = made;
    desc.contributions = contributions;
    EXPECT_DONE(splat_rasterizer_backward(rasterizer, nullptr, &desc));
    return {download(made), download(means), download(contributions)};
}

Floats slice_of(const Floats& all, std::size_t first, std::size_t count) {
    return {&all[first], &all[first] + count};
}

TEST(ApiRasterRanges, ViewsAreThoseOfCallsForTheirRanges) {
    const Scene scene = SampleScene(kSet).create();
    const Rasterizer any =
        make_rasterizer(shared_device(), rasterizer_desc(kSet, kSize, kSize, kWanted));
    ASSERT_DONE(draw_all(any, of_scene(scene, kThree)));
    auto info = sized<splat_rasterizer_info>();
    ASSERT_DONE(splat_rasterizer_get_info(any, nullptr, &info));
    EXPECT_EQ(info.items, 95U);
    const Floats rgb = output(any, SPLAT_OUTPUT_RGB, 9 * kAll),
                 ids = output(any, SPLAT_OUTPUT_IDS, 3 * kAll);
    const Floats depths = output(any, SPLAT_OUTPUT_DEPTHS, 95);
    const Sums all = sums_of(any, 3, {95, 2}, kSet);
    EXPECT_DONE(splat_rasterizer_output(any, nullptr, SPLAT_OUTPUT_MEANS2D,
                                        make_tensor(shared_device(), {95, 2})));
    EXPECT_REFUSED(splat_rasterizer_output(any, nullptr, SPLAT_OUTPUT_MEANS2D,
                                           make_tensor(shared_device(), {3, kSet, 2})),
                   SPLAT_ERROR_SHAPE_MISMATCH, "");
    const auto cameras = cameras_of(3);
    const Rasterizer second =
        make_rasterizer(shared_device(), rasterizer_desc(25, kSize, kSize, kWanted));
    ASSERT_DONE(splat_rasterizer_forward_scene(second, nullptr, sample_part(0, 25).create(),
                                               &cameras[1], 1, nullptr));
    EXPECT_EQ(slice_of(rgb, 3 * kAll, 3 * kAll), output(second, SPLAT_OUTPUT_RGB, 3 * kAll));
    EXPECT_EQ(slice_of(ids, kAll, kAll), output(second, SPLAT_OUTPUT_IDS, kAll));
    EXPECT_EQ(slice_of(depths, 35, 25), output(second, SPLAT_OUTPUT_DEPTHS, 25));
    const Sums of_second = sums_of(second, 1, {1, 25, 2}, 25);
    EXPECT_EQ(slice_of(all.means, 0, 75), of_second.means);
    EXPECT_EQ(slice_of(all.contributions, 0, 50), of_second.contributions);
    EXPECT_EQ(slice_of(all.means2d, 70, 50), of_second.means2d);
    const Rasterizer first =
        make_rasterizer(shared_device(), rasterizer_desc(35, kSize, kSize, kWanted));
    const splat_camera two[] = {cameras[0], cameras[2]};
    ASSERT_DONE(splat_rasterizer_forward_scene(first, nullptr, sample_part(25, 35).create(), two, 2,
                                               nullptr));
    const Floats one = output(first, SPLAT_OUTPUT_RGB, 6 * kAll);
    EXPECT_EQ(slice_of(rgb, 0, 3 * kAll), slice_of(one, 0, 3 * kAll));
    EXPECT_EQ(slice_of(rgb, 6 * kAll, 3 * kAll), slice_of(one, 3 * kAll, 3 * kAll));
    EXPECT_GE(*std::max_element(ids.begin(), ids.begin() + kAll), 25);
    const Sums of_first = sums_of(first, 2, {2, 35, 2}, 35);
    EXPECT_EQ(slice_of(all.means, 75, 105), of_first.means);
    EXPECT_EQ(slice_of(all.contributions, 50, 70), of_first.contributions);
}

TEST(ApiRasterRanges, TensorsASceneAndAFixedNumberAreAlike) {
    const Scene scene = SampleScene(kSet).create();
    const GaussianTensors tensors(shared_device(), scene);
    auto fixed = rasterizer_desc(kSet, kSize, kSize, kWanted, 3);
    fixed.items = 95;
    const Rasterizer made = make_rasterizer(shared_device(), fixed);
    ASSERT_DONE(draw_all(made, with_ranges(tensors.desc(), kThree)));
    const Floats rgb = output(made, SPLAT_OUTPUT_RGB, 9 * kAll);
    auto masked = of_scene(scene, kThree);
    const std::vector<std::uint8_t> tiles(3 * 4, 1);
    masked.active_tiles = tiles.data();
    masked.active_tile_count = tiles.size();
    ASSERT_DONE(draw_all(made, masked));
    EXPECT_EQ(output(made, SPLAT_OUTPUT_RGB, 9 * kAll), rgb);
    EXPECT_REFUSED(draw_all(made, of_scene(scene, {0, 60, 0, 20, 0, 16})), kArgument,
                   "views 0 to 2 hold 96 Gaussians, but it was made for 95");
    EXPECT_REFUSED(draw_all(made, of_scene(scene, {})), kArgument,
                   "60 Gaussians in 3 views, but it was made for at most 95");
    EXPECT_EQ(output(made, SPLAT_OUTPUT_RGB, 9 * kAll), rgb) << "the last images stay";
    const Rasterizer any =
        make_rasterizer(shared_device(), rasterizer_desc(kSet, kSize, kSize, kWanted));
    auto ranged = sized<splat_rasterizer_info>(), whole = ranged;
    ASSERT_DONE(draw_all(any, of_scene(scene, kThree)));
    ASSERT_DONE(splat_rasterizer_get_info(any, nullptr, &ranged));
    EXPECT_EQ(output(any, SPLAT_OUTPUT_RGB, 9 * kAll), rgb);
    ASSERT_DONE(draw_all(any, of_scene(scene, {})));
    ASSERT_DONE(splat_rasterizer_get_info(any, nullptr, &whole));
    EXPECT_GT(whole.bytes, ranged.bytes) << "memory is that of the ranges";
}

TEST(ApiRasterRanges, BadOnesAreRefused) {
    const Scene scene = SampleScene(kSet).create();
    const Rasterizer any = make_rasterizer(shared_device(), rasterizer_desc(kSet, kSize, kSize));
    const auto refused = [&](const splat_gaussians_desc& desc, const char* part) {
        EXPECT_REFUSED(draw_all(any, desc), kArgument, part);
    };
    refused(of_scene(scene, {0, 60, 0}), "view_range_count is 3, expected 6");
    refused(of_scene(scene, {0, 60, 59, 2, 0, 1}),
            "view 1 sees Gaussians 59 to 61, but there are 60");
    auto none = of_scene(scene, {});
    none.view_range_count = 6;
    refused(none, "view_ranges");
    auto both = GaussianTensors(shared_device(), scene).desc();
    both.scene = scene;
    refused(both, "scene and tensors are both given");
    auto older = of_scene(scene, {});
    older.struct_size = offsetof(splat_gaussians_desc, view_ranges);
    EXPECT_DONE(draw_all(any, older)) << "draws no Gaussians: nothing behind its size is read";
    auto info = sized<splat_rasterizer_info>();
    ASSERT_DONE(splat_rasterizer_get_info(any, nullptr, &info));
    EXPECT_EQ(info.gaussians, 0U);
    EXPECT_DONE(draw_all(any, of_scene(scene, {}), 0));
}

}  // namespace
}  // namespace splat::test

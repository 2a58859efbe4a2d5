// The C API and the C++ rasterizer give the same bits on the same scenes.
#include "api/raster_calls.h"
#include "raster/raster_scenes.h"
#include "raster/rasterizer_harness.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

splat_camera camera_value(const RasterCase& from) {
    const scene::Camera camera = camera_of(from);
    splat_camera value{camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy, {}};
    std::copy(camera.world_to_camera.begin(), camera.world_to_camera.end(), value.world_to_camera);
    return value;
}

/// A case as tensors, and the rasterizer for it.
struct Drawn {
    Drawn(const RasterCase& from, const RasterMode& mode, std::uint32_t flags);
    void forward();

    splat_camera camera;
    std::array<float, 3> background;
    splat_gaussians_desc desc = sized<splat_gaussians_desc>();
    Tensor means, scales, rotations, opacities, colors;
    Rasterizer rasterizer;
};

Drawn::Drawn(const RasterCase& from, const RasterMode& mode, std::uint32_t flags)
    : camera(camera_value(from)), background(from.background) {
    splat_device device = shared_device();
    const auto n = static_cast<std::int64_t>(from.count());
    means = upload(device, {n, 3}, from.means);
    scales = upload(device, {n, 3}, from.scales);
    rotations = upload(device, {n, 4}, from.rotations);
    opacities = upload(device, {n}, from.opacities);
    const bool direct = from.sh.empty();
    const auto k = static_cast<std::int64_t>(from.sh_coefficients);
    colors = direct ? upload(device, {n, 3}, from.colors) : upload(device, {n, k, 3}, from.sh);
    desc.means = means;
    desc.scales = scales;
    desc.rotations = rotations;
    desc.opacities = opacities;
    (direct ? desc.colors : desc.sh) = colors;
    const raster::RasterDesc expected = raster_desc(from, mode);
    if (direct) flags |= SPLAT_RASTERIZER_DIRECT_COLORS;
    if (mode.antialiased) flags |= SPLAT_RASTERIZER_ANTIALIASED;
    splat_rasterizer_desc made =
        rasterizer_desc(expected.gaussians, expected.width, expected.height, flags);
    made.sh_degree = expected.sh_degree;
    made.convention = mode.is_3dgs() ? SPLAT_CONVENTION_3DGS : SPLAT_CONVENTION_GSPLAT;
    rasterizer = make_rasterizer(device, made);
}

void Drawn::forward() {
    EXPECT_DONE(draw(rasterizer, desc, camera, background.data()));
}

std::vector<double> widened(const Floats& values) {
    return {values.begin(), values.end()};
}

template <class Value>
std::vector<double> doubles(const std::vector<Value>& values) {
    return {values.begin(), values.end()};
}

/// Reads an output to the host and to a tensor, which must agree.
std::vector<double> read(const Drawn& drawn, splat_output which, const Dims& dims) {
    std::size_t elements = 1;
    for (const std::int64_t size : dims) elements *= static_cast<std::size_t>(size);
    const Floats host = output(drawn.rasterizer, which, elements);
    const Tensor tensor = make_tensor(shared_device(), dims);
    EXPECT_DONE(splat_rasterizer_output(drawn.rasterizer, nullptr, which, tensor));
    EXPECT_EQ(download(tensor), host) << "output " << which;
    return widened(host);
}

void compare_outputs(const RasterCase& from, const RasterMode& mode) {
    Drawn drawn(from, mode,
                SPLAT_RASTERIZER_DEPTH | SPLAT_RASTERIZER_NORMALS | SPLAT_RASTERIZER_MEDIAN_DEPTH);
    drawn.forward();
    const RasterRun run =
        run_raster(*shared_context(vk::Kernels::kPlain), from, raster_desc(from, mode));
    ASSERT_TRUE(run.status.ok()) << run.status.message();
    const auto h = static_cast<std::int64_t>(from.camera.height);
    const auto w = static_cast<std::int64_t>(from.camera.width);
    const auto n = static_cast<std::int64_t>(from.count());
    const RasterOutputs& out = run.outputs;
    EXPECT_EQ(read(drawn, SPLAT_OUTPUT_RGB, {1, h, w, 3}), out.rgb) << from.name;
    EXPECT_EQ(read(drawn, SPLAT_OUTPUT_ALPHA, {1, h, w}), out.alpha);
    EXPECT_EQ(read(drawn, SPLAT_OUTPUT_DEPTH, {1, h, w}), out.depth);
    EXPECT_EQ(read(drawn, SPLAT_OUTPUT_EXPECTED_DEPTH, {1, h, w}), out.depth_expected);
    EXPECT_EQ(read(drawn, SPLAT_OUTPUT_MEDIAN_DEPTH, {1, h, w}), out.median);
    EXPECT_EQ(read(drawn, SPLAT_OUTPUT_NORMALS, {1, h, w, 3}), out.normal);
    EXPECT_EQ(read(drawn, SPLAT_OUTPUT_CONTRIBUTORS, {1, h, w}), doubles(out.n_contrib));
    EXPECT_EQ(read(drawn, SPLAT_OUTPUT_MEANS2D, {1, n, 2}), out.means2d);
    EXPECT_EQ(read(drawn, SPLAT_OUTPUT_RADII, {1, n, 2}), doubles(out.radii));
    EXPECT_EQ(read(drawn, SPLAT_OUTPUT_DEPTHS, {1, n}), out.depths);
    EXPECT_EQ(read(drawn, SPLAT_OUTPUT_VISIBILITY, {1, n}), doubles(out.valid));
    const std::vector<double> conics = read(drawn, SPLAT_OUTPUT_CONICS, {1, n, 3});
    for (std::size_t i = 0; i < conics.size(); ++i)
        EXPECT_EQ(conics[i], static_cast<double>(static_cast<float>(out.conics[i]))) << i;
    const auto info = got(splat_rasterizer_get_info, drawn.rasterizer, nullptr);
    EXPECT_EQ(info.visible, run.stats.visible);
    EXPECT_EQ(info.pairs, run.stats.pairs);
    EXPECT_EQ(info.tiles, run.stats.tiles);
    EXPECT_EQ(info.empty_tiles, run.stats.empty_tiles);
    EXPECT_EQ(info.longest, run.stats.longest);
    EXPECT_GE(info.bytes, run.stats.bytes);
}

RasterCase direct_colors(RasterCase from) {
    from.colors = normal_fill(3 * from.count(), 5);
    from.sh.clear();
    from.sh_coefficients = 0;
    return from;
}

TEST(ApiRaster, OutputsAreThoseOfTheRasterizer) {
    const RasterCase cases[] = {random_scene({200, 70, 50}, 1, 2),
                                direct_colors(random_scene({60, 33, 47}, 2)),
                                hostile_scene({80, 64, 48}, 3).with};
    for (const RasterMode& mode : kRasterModes)
        for (const RasterCase& from : cases) compare_outputs(from, mode);
}

/// The gradients of a run of each kind, float by float.
void compare_gradients(const RasterCase& from, const RasterMode& mode, bool original) {
    const std::uint32_t original_flag = original ? SPLAT_RASTERIZER_ORIGINAL_GRADIENT : 0;
    const std::uint32_t pose_flag = mode.is_3dgs() ? 0 : SPLAT_RASTERIZER_GRAD_POSE;
    Drawn drawn(from, mode,
                SPLAT_RASTERIZER_DEPTH | SPLAT_RASTERIZER_NORMALS | SPLAT_RASTERIZER_GRAD_DEPTH |
                    SPLAT_RASTERIZER_GRAD_MEANS2D | original_flag | pose_flag);
    const auto h = static_cast<std::int64_t>(from.camera.height);
    const auto w = static_cast<std::int64_t>(from.camera.width);
    const auto n = static_cast<std::int64_t>(from.count());
    const std::size_t pixels = from.pixels();
    const Floats by_rgb = normal_fill(3 * pixels, 21);
    const Floats by_alpha = normal_fill(pixels, 22);
    const Floats by_depth = normal_fill(pixels, 23);
    const ref::RasterLoss<double> loss = {widened(by_rgb), widened(by_alpha), widened(by_depth)};
    raster::RasterDesc desc = raster_desc(from, mode);
    desc.original_gradient = original;
    // Equal bits need equal pipelines: a driver may fuse multiply-adds otherwise if a kernel also computes the pose's
    // gradient.
    desc.backward = desc.grad_depth = desc.export_gradients = true;
    desc.grad_pose = !mode.is_3dgs();
    const RasterRun run = run_raster(*shared_context(vk::Kernels::kPlain), from, desc, &loss);
    ASSERT_TRUE(run.status.ok()) << run.status.message();

    drawn.forward();
    splat_device device = shared_device();
    const Tensor rgb = upload(device, {1, h, w, 3}, by_rgb);
    const Tensor alpha = upload(device, {1, h, w}, by_alpha);
    const Tensor depth = upload(device, {1, h, w}, by_depth);
    const auto k = static_cast<std::int64_t>(from.sh_coefficients);
    const bool direct = from.sh.empty();
    auto request = sized<splat_gradients_desc>();
    request.grad_rgb = rgb;
    request.grad_alpha = alpha;
    request.grad_depth = depth;
    struct Gradient {
        const char* what;
        splat_tensor& place;
        Dims dims;
        const std::vector<double>& expected;
        Tensor tensor = {};
    };
    std::vector<Gradient> gradients;
    gradients.push_back({"means", request.grad_means, {n, 3}, run.gradients.means});
    gradients.push_back({"scales", request.grad_scales, {n, 3}, run.gradients.scales});
    gradients.push_back({"rotations", request.grad_rotations, {n, 4}, run.gradients.rotations});
    gradients.push_back({"opacities", request.grad_opacities, {n}, run.gradients.opacities});
    gradients.push_back({"colours", direct ? request.grad_colors : request.grad_sh,
                         direct ? Dims{n, 3} : Dims{n, k, 3},
                         direct ? run.gradients.colors : run.gradients.sh});
    gradients.push_back({"means2d", request.grad_means2d, {1, n, 2}, run.gradients.means2d});
    gradients.push_back(
        {"means2d_abs", request.grad_means2d_abs, {1, n, 2}, run.gradients.means2d_abs});
    if (!mode.is_3dgs())
        gradients.push_back(
            {"pose", request.grad_world_to_camera, {1, 3, 4}, run.gradients.world_to_camera});
    for (Gradient& gradient : gradients)
        gradient.place = gradient.tensor = make_tensor(device, gradient.dims);
    for (int pass = 1; pass <= 2; ++pass) {  // the second adds the same again
        request.flags = pass == 2 ? SPLAT_GRADIENTS_ACCUMULATE : 0;
        EXPECT_DONE(splat_rasterizer_backward(drawn.rasterizer, nullptr, &request));
        for (const Gradient& gradient : gradients) {
            std::vector<double> expected = gradient.expected;
            for (double& value : expected) value *= pass;
            EXPECT_EQ(widened(download(gradient.tensor)), expected)
                << from.name << " " << gradient.what;
        }
    }
}

TEST(ApiRaster, GradientsAreThoseOfTheRasterizer) {
    const RasterCase with_sh = random_scene({150, 60, 45}, 4, 3);
    const RasterCase with_colors = direct_colors(random_scene({60, 33, 47}, 5));
    for (const RasterMode& mode : kRasterModes) {
        compare_gradients(with_sh, mode, false);
        compare_gradients(with_colors, mode, false);
    }
    compare_gradients(with_sh, kRasterModes[0], true);
}

/// The image is the same with each skip switched off.
TEST(ApiRaster, SkipsDoNotChangeTheImage) {
    const SampleScene sample(120);
    const Scene scene = sample.create();
    const splat_camera camera = sample_camera(50, 40);
    Floats first;
    for (const std::uint32_t off : {0U, 1U, 2U, 4U, 8U, 16U, 32U, 63U}) {
        splat_rasterizer_desc desc = rasterizer_desc(120, 50, 40);
        desc.disabled_skips = off;
        const Rasterizer rasterizer = make_rasterizer(shared_device(), desc);
        for (int pass = 0; pass < 2; ++pass) {
            EXPECT_DONE(draw(rasterizer, scene, camera));
            const auto info = got(splat_rasterizer_get_info, rasterizer, nullptr);
            EXPECT_EQ(info.runs, pass == 1 && (off & SPLAT_SKIP_UNCHANGED) == 0 ? 0U : 1U);
        }
        const Floats image = output(rasterizer, SPLAT_OUTPUT_RGB, 50 * 40 * 3);
        if (first.empty()) first = image;
        EXPECT_EQ(image, first) << "switched off: " << off;
    }
}

}  // namespace
}  // namespace splat::test

// Scenes and images of other programs, which are not in the repository, through the C API.
#include <algorithm>
#include <cmath>

#include "api/raster_calls.h"
#include "io/file.h"
#include "io/image.h"
#include "raster/fragile.h"
#include "raster/raster_case.h"
#include "support/npz.h"
#include "support/real_data.h"

namespace splat::test {
namespace {

/// With the fast kernels, unlike shared_device().
splat_device fast_device() {
    static const Device device = open_device();
    return device;
}

Scene load_scene(const std::string& name) {
    return got(splat_scene_load, (*real_data_folder() + "/" + name).c_str(), nullptr);
}

Floats array_of(const Npz& file, const char* name) {
    const auto found = file.find(name);
    EXPECT_TRUE(found.ok()) << name;
    if (found.value()->dtype[0] == 'i') {
        const auto values = found.value()->ints();
        EXPECT_TRUE(values.ok()) << name;
        return {values.value().begin(), values.value().end()};
    }
    const auto values = found.value()->f64();
    EXPECT_TRUE(values.ok()) << name;
    return {values.value().begin(), values.value().end()};
}

/// Pinhole camera of a file's viewmat [4,4] and K [3,3].
splat_camera camera_of(const float* viewmat, const Floats& k, std::uint32_t width,
                       std::uint32_t height) {
    const auto wide = [](float value) { return static_cast<double>(value); };
    splat_camera camera{width, height, wide(k[0]), wide(k[4]), wide(k[2]), wide(k[5]), {}};
    std::copy_n(viewmat, 16, camera.world_to_camera);
    return camera;
}

double max_difference(const Floats& a, const Floats& b) {
    EXPECT_EQ(a.size(), b.size());
    double most = 0;
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
        most = std::max(most, std::abs(static_cast<double>(a[i]) - static_cast<double>(b[i])));
    return most;
}

/// The image that gsplat's CUDA rasterizer made of four Gaussians.
TEST(ApiRealScenes, FourGaussiansAsCudaDrewThem) {
    SPLAT_NEEDS_REAL_DATA();
    const auto read = Npz::read(*real_data_folder() + "/gsplat_cuda/gsplat_cuda_tiny_case.npz");
    ASSERT_TRUE(read.ok()) << read.status().message();
    const Npz& file = read.value();
    splat_device device = fast_device();
    const Tensor means = upload(device, {4, 3}, array_of(file, "in_means"));
    const Tensor scales = upload(device, {4, 3}, array_of(file, "in_scales"));
    const Tensor rotations = upload(device, {4, 4}, array_of(file, "in_quats"));
    const Tensor opacities = upload(device, {4}, array_of(file, "in_opacities"));
    const Tensor sh = upload(device, {4, 16, 3}, array_of(file, "in_sh"));
    auto gaussians = sized<splat_gaussians_desc>();
    gaussians.means = means;
    gaussians.scales = scales;
    gaussians.rotations = rotations;
    gaussians.opacities = opacities;
    gaussians.sh = sh;
    splat_rasterizer_desc desc = rasterizer_desc(4, 123, 82);
    desc.sh_degree = 3;
    desc.convention = SPLAT_CONVENTION_GSPLAT;
    const Rasterizer rasterizer = make_rasterizer(device, desc);
    const splat_camera camera =
        camera_of(array_of(file, "in_viewmat").data(), array_of(file, "in_K"), 123, 82);
    ASSERT_DONE(draw(rasterizer, gaussians, camera));
    const double rgb = max_difference(output(rasterizer, SPLAT_OUTPUT_RGB, 123 * 82 * 3),
                                      array_of(file, "gsplat_cuda_rgb"));
    const double alpha = max_difference(output(rasterizer, SPLAT_OUTPUT_ALPHA, 123 * 82),
                                        array_of(file, "gsplat_cuda_alpha"));
    EXPECT_LE(rgb, 2e-6);
    EXPECT_LE(alpha, 2e-6);
    std::printf("tiny case: RGB %.3g, alpha %.3g from CUDA's\n", rgb, alpha);
}

Floats attribute(splat_scene scene, const char* name, std::size_t elements) {
    return floats_of(elements, splat_scene_read, scene, name);
}

/// The scene and a camera as the float64 reference takes them.
RasterCase raster_case(splat_scene scene, const splat_camera& camera) {
    const std::size_t n = info_of(scene).count;
    RasterCase made;
    made.means = attribute(scene, "means", 3 * n);
    made.scales = attribute(scene, "scales", 3 * n);
    made.rotations = attribute(scene, "rotations", 4 * n);
    made.opacities = attribute(scene, "opacities", n);
    made.sh = attribute(scene, "sh", 3 * n);
    made.sh_coefficients = 1;
    const auto narrow = [](double value) { return static_cast<float>(value); };
    made.camera = {narrow(camera.fx),
                   narrow(camera.fy),
                   narrow(camera.cx),
                   narrow(camera.cy),
                   camera.width,
                   camera.height,
                   {}};
    for (std::size_t i = 0; i < 16; ++i)
        made.camera.world_to_camera[i] = narrow(camera.world_to_camera[i]);
    return made;
}

/// Two views of the guitar in float64. Only pixels that rounding decides may differ by more.
TEST(ApiRealScenes, GuitarAsFloat64DrewIt) {
    SPLAT_NEEDS_REAL_DATA();
    const auto read = Npz::read(*real_data_folder() + "/derived/guitar_render_golden.npz");
    ASSERT_TRUE(read.ok()) << read.status().message();
    const Scene scene = load_scene("derived/guitar_inria_sh0.ply");
    splat_rasterizer_desc desc = rasterizer_desc(90854, 144, 240, SPLAT_RASTERIZER_DEPTH);
    desc.views = 2;
    desc.sh_degree = 0;
    desc.convention = SPLAT_CONVENTION_GSPLAT;
    const Rasterizer rasterizer = make_rasterizer(fast_device(), desc);
    const Floats viewmats = array_of(read.value(), "viewmats");
    const Floats k = array_of(read.value(), "K");
    const splat_camera cameras[] = {camera_of(viewmats.data(), k, 144, 240),
                                    camera_of(viewmats.data() + 16, k, 144, 240)};
    ASSERT_DONE(splat_rasterizer_forward_scene(rasterizer, nullptr, scene, cameras, 2, nullptr));
    constexpr std::size_t kPixels = std::size_t{144} * 240;
    const auto rgb = output(rasterizer, SPLAT_OUTPUT_RGB, 2 * 3 * kPixels);
    const auto alpha = output(rasterizer, SPLAT_OUTPUT_ALPHA, 2 * kPixels);
    const auto expected_rgb = array_of(read.value(), "rgb");
    const auto expected_alpha = array_of(read.value(), "alpha");
    double worst = 0;
    std::size_t excused = 0;
    for (std::size_t view = 0; view < 2; ++view) {
        std::vector<std::size_t> off;
        for (std::size_t i = 0; i < kPixels; ++i) {
            const std::size_t p = view * kPixels + i;
            double error = std::abs(double{alpha[p]} - double{expected_alpha[p]});
            for (std::size_t c = 3 * p; c < 3 * p + 3; ++c)
                error = std::max(error, std::abs(double{rgb[c]} - double{expected_rgb[c]}));
            if (error > 1e-5)
                off.push_back(i);
            else
                worst = std::max(worst, error);
        }
        const std::vector<bool> fragile = fragile_pixels(
            reference_scene<double>(raster_case(scene, cameras[view]), kRasterModes[1]), off);
        for (std::size_t i = 0; i < off.size(); ++i)
            EXPECT_TRUE(fragile[i]) << "pixel " << off[i] << " of view " << view;
        excused += off.size();
    }
    EXPECT_LE(excused, 2 * kPixels / 1000);
    std::printf("guitar: %.3g off, %zu of %zu pixels fragile and further off\n", worst, excused,
                2 * kPixels);
}

/// The photographs of the guitar, rendered by another program and rounded to 8 bits.
TEST(ApiRealScenes, GuitarAsPhotographed) {
    SPLAT_NEEDS_REAL_DATA();
    const Scene scene = load_scene("derived/guitar_inria_sh0.ply");
    const std::string folder = *real_data_folder() + "/images/guitar_orbit";
    std::uint32_t count = 0;
    const std::string path = folder + "/transforms.json";
    ASSERT_EQ(splat_camera_load(path.c_str(), nullptr, nullptr, 0, &count), SPLAT_INCOMPLETE);
    ASSERT_EQ(count, 14U);
    std::vector<splat_camera> cameras(count);
    ASSERT_DONE(splat_camera_load(path.c_str(), nullptr, cameras.data(), count, &count));
    std::vector<splat_camera> colmap(count);
    ASSERT_DONE(splat_camera_load(folder.c_str(), nullptr, colmap.data(), count, &count));
    splat_rasterizer_desc desc = rasterizer_desc(90854, 144, 240);
    desc.views = count;
    desc.sh_degree = 0;
    desc.convention = SPLAT_CONVENTION_GSPLAT;
    const Rasterizer rasterizer = make_rasterizer(fast_device(), desc);
    ASSERT_DONE(
        splat_rasterizer_forward_scene(rasterizer, nullptr, scene, cameras.data(), count, nullptr));
    constexpr std::size_t kValues = 144 * 240 * 3;
    const Floats rgb = output(rasterizer, SPLAT_OUTPUT_RGB, count * kValues);
    double least = 1e9;
    for (std::uint32_t view = 0; view < count; ++view) {
        for (std::size_t i = 0; i < 16; ++i)
            EXPECT_NEAR(colmap[view].world_to_camera[i], cameras[view].world_to_camera[i], 1e-6);
        char name[32];
        std::snprintf(name, sizeof name, "/images/%03u.png", view);
        const auto file = io::read_file(folder + name);
        ASSERT_TRUE(file.ok()) << file.status().message();
        const auto image = io::read_png(file.value());
        ASSERT_TRUE(image.ok()) << image.status().message();
        ASSERT_EQ(image.value().samples.size(), kValues);
        double squares = 0;
        for (std::size_t i = 0; i < kValues; ++i) {
            const double got = std::clamp(static_cast<double>(rgb[view * kValues + i]), 0.0, 1.0);
            const double difference = got - image.value().samples[i] / 255.0;
            squares += difference * difference;
        }
        least = std::min(least, -10 * std::log10(squares / kValues));
    }
    EXPECT_GE(least, 50.0);
    std::printf("guitar_orbit: at least %.2f dB in %u views\n", least, count);
}

}  // namespace
}  // namespace splat::test

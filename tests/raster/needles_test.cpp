// Conics of needles in float32: the determinant of the reference against a c - b^2.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "raster/raster_scenes.h"
#include "ref/project_ref.h"

namespace splat::test {
namespace {

/// The error of a c - b^2 grows with the square of the focal length in pixels, that of the
/// reference does not.
constexpr SceneSize kNeedles{4000, 200, 160};

/// Errors of conics relative to the largest of their three numbers, sorted.
struct ConicErrors {
    std::vector<double> naive;
    std::vector<double> robust;
    std::size_t naive_refused = 0;  ///< determinant <= 0

    static double median(const std::vector<double>& errors) { return errors[errors.size() / 2]; }
};

double conic_error(const std::array<float, 3>& got, const std::array<double, 3>& expected) {
    double error = 0;
    double size = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        error = std::max(error, std::abs(static_cast<double>(got[k]) - expected[k]));
        size = std::max(size, std::abs(expected[k]));
    }
    return error / size;
}

/// J R Sigma R^T J^T in float32 from the covariance Sigma, as in published rasterizers; 0 0 0 if
/// the determinant is not positive.
std::array<float, 3> naive_conic(const ref::RasterScene<float>& scene,
                                 const ref::CameraFrame<float>& frame, std::size_t i,
                                 const ref::ProjectedGaussian<float>& g) {
    ref::Mat3<float> scaled = g.rotation;
    for (auto& row : scaled)
        for (std::size_t k = 0; k < 3; ++k) row[k] *= scene.scales[3 * i + k];
    const ref::Mat3<float> sigma = ref::product(scaled, ref::transposed(scaled));
    const float z = g.camera_mean[2];
    ref::Mat3<float> jacobian{};
    jacobian[0] = {scene.camera.fx / z, 0, -scene.camera.fx * g.slope[0] / z};
    jacobian[1] = {0, scene.camera.fy / z, -scene.camera.fy * g.slope[1] / z};
    const ref::Mat3<float> map = ref::product(jacobian, frame.rotation);
    const ref::Mat3<float> cov = ref::product(ref::product(map, sigma), ref::transposed(map));
    const float a = cov[0][0] + raster::kDilation;
    const float b = cov[0][1];
    const float c = cov[1][1] + raster::kDilation;
    const float det = a * c - b * b;
    if (!(det > 0)) return {};
    return {c / det, -b / det, a / det};
}

ConicErrors conic_errors(double length) {
    const RasterCase needles = needle_scene(kNeedles, 50, length);
    const auto scene = reference_scene<float>(needles, kRasterModes[1]);
    const ref::CameraFrame<float> frame(scene.camera);
    const auto in_float = ref::project_forward(scene);
    const auto exact = ref::project_forward(reference_scene<double>(needles, kRasterModes[1]));
    ConicErrors errors;
    for (const std::uint32_t i : exact.order) {
        const ref::ProjectedGaussian<float>& g = in_float.gaussians[i];
        if (!g.valid) continue;
        const std::array<double, 3>& expected = exact.gaussians[i].conic;
        errors.robust.push_back(conic_error(g.conic, expected));
        const std::array<float, 3> naive = naive_conic(scene, frame, i, g);
        if (naive[0] == 0) ++errors.naive_refused;
        errors.naive.push_back(naive[0] == 0 ? 1 : conic_error(naive, expected));
    }
    std::sort(errors.naive.begin(), errors.naive.end());
    std::sort(errors.robust.begin(), errors.robust.end());
    return errors;
}

void report(const char* name, const ConicErrors& errors) {
    std::printf(
        "%s: %zu needles; a c - b^2: median %.1e, worst %.1e, %zu refused; "
        "|v1 x v2|^2: median %.1e, worst %.1e\n",
        name, errors.robust.size(), ConicErrors::median(errors.naive), errors.naive.back(),
        errors.naive_refused, ConicErrors::median(errors.robust), errors.robust.back());
}

TEST(Needles, ConicsOfAxisRatio1e4) {
    const ConicErrors errors = conic_errors(1);
    report("ratio to 1e4", errors);
    ASSERT_GT(errors.robust.size(), 3000U);
    EXPECT_LT(ConicErrors::median(errors.robust), 3e-7);
    EXPECT_LT(errors.robust.back(), 2e-5);
    EXPECT_GT(ConicErrors::median(errors.naive), 1e-5) << "the generator makes no needles";
}

TEST(Needles, ConicsOfLongerOnes) {
    const ConicErrors thirty = conic_errors(30);
    const ConicErrors thousand = conic_errors(1000);
    report("30 times as long", thirty);
    report("1000 times as long", thousand);
    EXPECT_LT(ConicErrors::median(thirty.robust), 3e-7);
    EXPECT_LT(ConicErrors::median(thousand.robust), 3e-7);
    EXPECT_GT(ConicErrors::median(thirty.naive), 1e-2);
    EXPECT_GT(thousand.naive_refused, thousand.naive.size() / 4);
}

}  // namespace
}  // namespace splat::test

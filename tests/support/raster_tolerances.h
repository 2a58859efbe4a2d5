#pragma once

#include <string_view>

namespace splat::test {

/// Who is judged, and on what.
enum class RasterJudge {
    kFloat32,         ///< a kernel
    kFloat32Needles,  ///< a kernel, on scenes of needles (axis ratios of 1e3 and more)
    kFloat64,         ///< the reference against golden files
    kFloat64Needles,
};

/// What a figure is multiplied with.
enum class RasterScale {
    kAbsolute,
    kOfLargest,  ///< the largest magnitude of the whole tensor
    kOfRow,      ///< the largest magnitude of the same Gaussian's numbers, or 1 if that is less
};

/// How far a result of the rasterizer may lie from its expectation, off the fragile pixels.
struct RasterTolerance {
    std::string_view result;
    RasterScale scale;
    double usual;
    double needles;
    const char* reason;
};

/// Float32 against float64; integers are equal. "seen": the reference instantiated with float, over
/// golden/raster and the scenes of tests/raster/raster_scenes.h, usual / needles. For needles
/// sigma is a sum of terms 1e3 times its size, each with the rounding of the conic.
inline constexpr RasterTolerance kRasterTolerances[] = {
    {"rgb", RasterScale::kAbsolute, 1e-5, 1e-4, "goal of the project; seen 4.4e-6 / 1.9e-5"},
    {"alpha", RasterScale::kAbsolute, 1e-5, 1e-4, "as rgb; seen 6.1e-6 / 3.7e-5"},
    {"normal", RasterScale::kAbsolute, 1e-5, 1e-4, "as rgb, of unit vectors; seen 6e-6 / 2.9e-5"},
    {"depth", RasterScale::kOfLargest, 1e-5, 1e-4, "as alpha; seen 3.5e-6 / 3.4e-5"},
    {"depth_expected", RasterScale::kOfLargest, 2e-5, 1e-4,
     "a quotient by alphas down to 1/255; seen 7.5e-6 / 1.9e-5"},
    {"median", RasterScale::kOfLargest, 1e-6, 1e-6, "as depths: that of one Gaussian's mean"},
    {"median_of_rays", RasterScale::kOfLargest, 1e-5, 1e-4,
     "a quotient, which cancels for what is thin; seen 2.5e-6 / 9.3e-5"},
    {"means2d", RasterScale::kOfRow, 1e-5, 1e-5,
     "at the left rim cx and fx x / z cancel, in images of a hundred pixels; seen 2e-6"},
    {"conics", RasterScale::kOfRow, 2e-5, 2e-5,
     "determinant without cancellation; with a c - b^2 needles lose 5e-3; seen 3.6e-6"},
    {"depths", RasterScale::kOfRow, 1e-6, 1e-6, "a dot product; seen 4e-7"},
    {"colors", RasterScale::kOfRow, 2e-6, 2e-6, "a sum of 16 terms; seen 4e-7"},
    {"compensations", RasterScale::kAbsolute, 2e-6, 2e-6, "a root of a quotient; seen 2.5e-7"},
    {"gradient", RasterScale::kOfLargest, 2e-5, 1e-3,
     "sums over pixels of terms of both signs; running sums reach 2.5e-5, sums per tile less; "
     "-Q Gq Q A cancels for needles, Q Gq (Q A) ten times less; seen 2.5e-5 / 5.9e-4"},
};

/// Pixels that rounding decides: one more or one less of alpha 1/255, a stop one Gaussian early
/// (T < 0.01 there), two of equal depth swapped. Relative to the largest; seen 1.1e-3.
inline constexpr double kRasterFragile = 0.02;

/// Gradients of Gaussians that fill the image from just behind the near plane cancel more than the figure
/// above, in any order of summation: the largest error of a tensor by the float32 reference, times this,
/// since kernels sum in another order. Of 400 random scenes one needs more than 1, none more than 4.
inline constexpr double kRasterOfFloat32 = 4;

/// Float64 against float64, of the largest: other orders of summation; seen 2.2e-12.
inline constexpr double kRasterFloat64 = 1e-11;
/// The files took det0 of needles as a difference, which costs them 1e-9 and more of it in the
/// compensation's gradient; seen 1.5e-10.
inline constexpr double kRasterFloat64Needles = 1e-9;

constexpr const RasterTolerance& raster_tolerance(std::string_view result) {
    for (const RasterTolerance& row : kRasterTolerances)
        if (row.result == result) return row;
    throw "no row in kRasterTolerances";
}

}  // namespace splat::test

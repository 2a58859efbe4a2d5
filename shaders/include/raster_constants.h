// Constants of the conventions of 3D Gaussian splatting, for GLSL and C++.
//
// float constants take part in decisions (is a Gaussian seen, does a pixel stop): kernels and
// float64 reference use the same float32 value, the reference widened. Spherical harmonics are
// ordinary numbers: float in GLSL, double in C++, and their rounding is ordinary error.

#ifndef SPLAT_RASTER_CONSTANTS_H
#define SPLAT_RASTER_CONSTANTS_H

#ifdef __cplusplus
#include <cstdint>
#define SPLAT_CONST_UINT inline constexpr std::uint32_t
#define SPLAT_CONST_FLOAT inline constexpr float
#define SPLAT_CONST_NUMBER inline constexpr double
namespace splat::raster {
#else
#define SPLAT_CONST_UINT const uint
#define SPLAT_CONST_FLOAT const float
#define SPLAT_CONST_NUMBER const float
#endif

SPLAT_CONST_UINT kTileSize = 16u;  // pixels; part of the semantics of 3dgs

// Blending, both conventions.
SPLAT_CONST_FLOAT kAlphaMin = 0.00392156886f;         // 1/255: fainter is skipped
SPLAT_CONST_FLOAT kAlphaMax = 0.99f;                  // denser is clamped
SPLAT_CONST_FLOAT kTransmittanceMin = 0.0001f;        // a pixel stops before it would fall below
SPLAT_CONST_FLOAT kCutReach = 6.49212769f;            // 3 sigma, if cut there: 9/2 log2(e)
SPLAT_CONST_FLOAT kMedianTransmittance = 0.5f;        // the median depth is the last in front of more
SPLAT_CONST_FLOAT kExpectedAlphaMin = 0.0000000001f;  // floor of the divisor of expected depth

// Projection, both conventions.
SPLAT_CONST_FLOAT kDilation = 0.3f;            // pixels^2 added to the projected variances
SPLAT_CONST_FLOAT kCompensationMin = 0.005f;   // floor of sqrt(det0/det)
SPLAT_CONST_FLOAT kQuaternionMin = 0.000001f;  // shorter rotations (norm) are absent Gaussians

// 3dgs.
SPLAT_CONST_FLOAT kNear3dgs = 0.2f;              // depth <= kNear3dgs is culled
SPLAT_CONST_FLOAT kFovMargin3dgs = 1.3f;         // clamp of x/z: factor of the half field of view
SPLAT_CONST_FLOAT kLambdaFloor = 0.1f;           // under the root of the eigenvalues
SPLAT_CONST_FLOAT kSigma3dgs = 3.0f;             // half size of the square, in standard deviations
SPLAT_CONST_FLOAT kHomogeneousMin = 0.0000001f;  // added to w before the division
SPLAT_CONST_FLOAT kConicGradMin = 0.0000001f;    // original gradient: added to det^2

// gsplat.
SPLAT_CONST_FLOAT kNearGsplat = 0.01f;          // depth < kNearGsplat is culled
SPLAT_CONST_FLOAT kFarGsplat = 10000000000.0f;  // depth > kFarGsplat is culled
SPLAT_CONST_FLOAT kFovMarginGsplat = 0.3f;      // clamp of x/z: margin in half fields of view
SPLAT_CONST_FLOAT kMaxSigma = 3.33f;            // largest extent, in standard deviations

// Ray maximum (Yu et al. 2024, Gaussian Opacity Fields); its near plane is that of 3dgs.
SPLAT_CONST_FLOAT kRayVariance = 0.0000001f;  // added to the squares of scales

// Real spherical harmonics of a direction (x, y, z), constant term first:
//   0: 1
//   1: y, z, x
//   2: xy, yz, 2zz-xx-yy, xz, xx-yy
//   3: y(3xx-yy), xyz, y(4zz-xx-yy), z(2zz-3xx-3yy), x(4zz-xx-yy), z(xx-yy), x(xx-3yy)
SPLAT_CONST_NUMBER kSh0 = 0.28209479177387814;
SPLAT_CONST_NUMBER kSh1y = -0.4886025119029199;
SPLAT_CONST_NUMBER kSh1z = 0.4886025119029199;
SPLAT_CONST_NUMBER kSh1x = -0.4886025119029199;
SPLAT_CONST_NUMBER kSh20 = 1.0925484305920792;
SPLAT_CONST_NUMBER kSh21 = -1.0925484305920792;
SPLAT_CONST_NUMBER kSh22 = 0.31539156525252005;
SPLAT_CONST_NUMBER kSh23 = -1.0925484305920792;
SPLAT_CONST_NUMBER kSh24 = 0.5462742152960396;
SPLAT_CONST_NUMBER kSh30 = -0.5900435899266435;
SPLAT_CONST_NUMBER kSh31 = 2.890611442640554;
SPLAT_CONST_NUMBER kSh32 = -0.4570457994644658;
SPLAT_CONST_NUMBER kSh33 = 0.3731763325901154;
SPLAT_CONST_NUMBER kSh34 = -0.4570457994644658;
SPLAT_CONST_NUMBER kSh35 = 1.445305721320277;
SPLAT_CONST_NUMBER kSh36 = -0.5900435899266435;
SPLAT_CONST_FLOAT kShOffset = 0.5f;  // added to the sum before the clamp at 0

#ifdef __cplusplus
}
#endif
#undef SPLAT_CONST_UINT
#undef SPLAT_CONST_FLOAT
#undef SPLAT_CONST_NUMBER

#endif

#pragma once

#include <array>
#include <cstddef>

#include "raster_constants.h"
#include "ref/raster_scene_ref.h"

/// Real spherical harmonics up to degree 3 and their derivatives, as polynomials of a direction.
///
/// The derivatives are those of the polynomials; the caller projects them on the sphere.
namespace splat::ref {

inline constexpr std::size_t kMostShCoefficients = 16;

template <class Real>
std::array<Real, kMostShCoefficients> sh_basis(const Vec3<Real>& direction) {
    const auto [x, y, z] = direction;
    const Real xx = x * x;
    const Real yy = y * y;
    const Real zz = z * z;
    const auto k = [](double constant) { return static_cast<Real>(constant); };
    using namespace raster;
    return {k(kSh0),
            k(kSh1y) * y,
            k(kSh1z) * z,
            k(kSh1x) * x,
            k(kSh20) * x * y,
            k(kSh21) * y * z,
            k(kSh22) * (k(2) * zz - xx - yy),
            k(kSh23) * x * z,
            k(kSh24) * (xx - yy),
            k(kSh30) * y * (k(3) * xx - yy),
            k(kSh31) * x * y * z,
            k(kSh32) * y * (k(4) * zz - xx - yy),
            k(kSh33) * z * (k(2) * zz - k(3) * xx - k(3) * yy),
            k(kSh34) * x * (k(4) * zz - xx - yy),
            k(kSh35) * z * (xx - yy),
            k(kSh36) * x * (xx - k(3) * yy)};
}

/// Derivatives of each function with respect to x, y and z.
template <class Real>
std::array<Vec3<Real>, kMostShCoefficients> sh_basis_gradient(const Vec3<Real>& direction) {
    const auto [x, y, z] = direction;
    const Real xx = x * x;
    const Real yy = y * y;
    const Real zz = z * z;
    const auto k = [](double constant) { return static_cast<Real>(constant); };
    const auto scaled = [&k](double constant, Real dx, Real dy, Real dz) {
        return Vec3<Real>{k(constant) * dx, k(constant) * dy, k(constant) * dz};
    };
    using namespace raster;
    return {scaled(kSh0, 0, 0, 0),
            scaled(kSh1y, 0, 1, 0),
            scaled(kSh1z, 0, 0, 1),
            scaled(kSh1x, 1, 0, 0),
            scaled(kSh20, y, x, 0),
            scaled(kSh21, 0, z, y),
            scaled(kSh22, k(-2) * x, k(-2) * y, k(4) * z),
            scaled(kSh23, z, 0, x),
            scaled(kSh24, k(2) * x, k(-2) * y, 0),
            scaled(kSh30, k(6) * x * y, k(3) * (xx - yy), 0),
            scaled(kSh31, y * z, x * z, x * y),
            scaled(kSh32, k(-2) * x * y, k(4) * zz - xx - k(3) * yy, k(8) * y * z),
            scaled(kSh33, k(-6) * x * z, k(-6) * y * z, k(6) * zz - k(3) * (xx + yy)),
            scaled(kSh34, k(4) * zz - k(3) * xx - yy, k(-2) * x * y, k(8) * x * z),
            scaled(kSh35, k(2) * x * z, k(-2) * y * z, xx - yy),
            scaled(kSh36, k(3) * (xx - yy), k(-6) * x * y, 0)};
}

}  // namespace splat::ref

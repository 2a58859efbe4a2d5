#pragma once

#include <array>

#include "scene/gaussians.h"
#include "scene/vector.h"

namespace splat::scene {

inline constexpr std::size_t kMaxShCoefficients = sh_coefficients(kMaxShDegree);

/// The constant basis function, 1 / (2 sqrt(pi)): colour = 0.5 + kSh0 sh[0] for degree 0.
inline constexpr double kSh0 = 0.28209479177387814;

/// Real spherical harmonics Y_0 .. Y_15 of a direction of length 1, in the order and with the signs
/// of 3DGS: 1; -y, z, -x; xy, yz, 2z2-x2-y2, xz, x2-y2; y(3x2-y2), xyz, ...
std::array<double, kMaxShCoefficients> sh_basis(const Vec3& direction);

/// Transforms coefficients with a scene to which an orthogonal matrix m (rotation or mirror) is applied: the
/// colour seen along m d afterwards is the one seen along d before. Bands do not mix.
///
/// Precision    1e-14 relative to the largest coefficient of the band
/// Source       the functions are orthonormal, so entry (j, k) is the integral of Y_j(m d) Y_k(d)
///              over the sphere; Gauss-Legendre x uniform quadrature is exact for this degree
class ShTransform {
  public:
    explicit ShTransform(const Mat3& m);

    /// Coefficients [sh_coefficients(degree), 3] of one Gaussian, in place.
    void apply(float* sh, std::uint32_t degree) const;

  private:
    std::array<std::array<double, kMaxShCoefficients>, kMaxShCoefficients> matrix_{};
};

}  // namespace splat::scene

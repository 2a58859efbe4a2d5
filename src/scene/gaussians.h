#pragma once

#include <cstdint>
#include <vector>

namespace splat::scene {

/// Highest degree of spherical harmonics that scenes hold.
inline constexpr std::uint32_t kMaxShDegree = 3;

/// Coefficients per colour channel of a degree.
constexpr std::uint32_t sh_coefficients(std::uint32_t degree) {
    return (degree + 1) * (degree + 1);
}

/// What the file of a scene says of drawing it, where formats differ.
struct DrawnAs {
    bool antialiased = false;    ///< opacities compensate for the dilation (Yu et al. 2024, Mip-Splatting)
    bool by_distance = false;    ///< blended by the distance to the camera, not by depth
    bool three_sigma = false;    ///< a Gaussian ends at 3 sigma
    bool linear_colors = false;  ///< colours are blended linear, then converted to sRGB

    bool operator==(const DrawnAs&) const = default;
};

/// A set of 3D Gaussians in host memory, structure of arrays, in the parameters that 3DGS files
/// store, so that files survive a round trip. Frame: the one of 3DGS .ply files (x right, y down,
/// z forward). Colour of a direction d: max(0, 0.5 + sum_k sh[k] Y_k(d)), RGB as it is
/// blended: of the display, or linear (DrawnAs).
struct Gaussians {
    std::uint32_t sh_degree = 0;        ///< 0 to kMaxShDegree
    std::vector<float> means;           ///< [n,3] scene units
    std::vector<float> log_scales;      ///< [n,3] natural logarithm of the standard deviations
    std::vector<float> rotations;       ///< [n,4] quaternions w, x, y, z; of length 1
    std::vector<float> opacity_logits;  ///< [n] opacity = 1 / (1 + exp(-logit))
    std::vector<float> sh;              ///< [n,(sh_degree+1)^2,3] constant term first
    DrawnAs drawn_as;

    [[nodiscard]] std::size_t count() const { return opacity_logits.size(); }
};

}  // namespace splat::scene

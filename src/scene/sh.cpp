#include "scene/sh.h"

#include <numbers>

namespace splat::scene {
namespace {

constexpr double kC1 = 0.4886025119029199;
constexpr double kC2[] = {1.0925484305920792, -1.0925484305920792, 0.31539156525252005,
                          -1.0925484305920792, 0.5462742152960396};
constexpr double kC3[] = {-0.5900435899266435, 2.890611442640554,   -0.4570457994644658,
                          0.3731763325901154,  -0.4570457994644658, 1.445305721320277,
                          -0.5900435899266435};

struct Node {
    Vec3 direction;
    double weight;
};

/// Integrates polynomials of degree <= 7 over the sphere: 4 Gauss-Legendre heights times 8 angles.
std::array<Node, 32> sphere_quadrature() {
    constexpr double kHeights[] = {-0.8611363115940526, -0.3399810435848563, 0.3399810435848563,
                                   0.8611363115940526};
    constexpr double kWeights[] = {0.3478548451374538, 0.6521451548625461, 0.6521451548625461,
                                   0.3478548451374538};
    std::array<Node, 32> nodes{};
    for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t j = 0; j < 8; ++j) {
            const double angle = static_cast<double>(j) * std::numbers::pi / 4;
            const double radius = std::sqrt(1 - kHeights[i] * kHeights[i]);
            nodes[i * 8 + j] = {{radius * std::cos(angle), radius * std::sin(angle), kHeights[i]},
                                kWeights[i] * std::numbers::pi / 4};
        }
    return nodes;
}

}  // namespace

std::array<double, kMaxShCoefficients> sh_basis(const Vec3& direction) {
    const auto& [x, y, z] = direction;
    const double xx = x * x;
    const double yy = y * y;
    const double zz = z * z;
    return {kSh0,
            -kC1 * y,
            kC1 * z,
            -kC1 * x,
            kC2[0] * x * y,
            kC2[1] * y * z,
            kC2[2] * (2 * zz - xx - yy),
            kC2[3] * x * z,
            kC2[4] * (xx - yy),
            kC3[0] * y * (3 * xx - yy),
            kC3[1] * x * y * z,
            kC3[2] * y * (4 * zz - xx - yy),
            kC3[3] * z * (2 * zz - 3 * xx - 3 * yy),
            kC3[4] * x * (4 * zz - xx - yy),
            kC3[5] * z * (xx - yy),
            kC3[6] * x * (xx - 3 * yy)};
}

ShTransform::ShTransform(const Mat3& m) {
    for (const Node& node : sphere_quadrature()) {
        const auto before = sh_basis(node.direction);
        const auto after = sh_basis(m * node.direction);
        for (std::size_t j = 0; j < kMaxShCoefficients; ++j)
            for (std::size_t k = 0; k < kMaxShCoefficients; ++k)
                matrix_[j][k] += node.weight * after[j] * before[k];
    }
}

void ShTransform::apply(float* sh, std::uint32_t degree) const {
    for (std::size_t band = 1; band <= degree; ++band) {
        const std::size_t first = band * band;
        const std::size_t count = 2 * band + 1;
        for (std::size_t channel = 0; channel < 3; ++channel) {
            std::array<double, 2 * kMaxShDegree + 1> old{};
            for (std::size_t k = 0; k < count; ++k)
                old[k] = static_cast<double>(sh[(first + k) * 3 + channel]);
            for (std::size_t j = 0; j < count; ++j) {
                double sum = 0;
                for (std::size_t k = 0; k < count; ++k)
                    sum += matrix_[first + j][first + k] * old[k];
                sh[(first + j) * 3 + channel] = static_cast<float>(sum);
            }
        }
    }
}

}  // namespace splat::scene

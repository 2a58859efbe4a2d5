#pragma once

#include <array>
#include <cmath>

namespace splat::scene {

using Vec3 = std::array<double, 3>;
using Mat3 = std::array<std::array<double, 3>, 3>;  ///< rows
using Mat4 = std::array<double, 16>;                ///< row-major
using Quaternion = std::array<double, 4>;           ///< w, x, y, z

constexpr double dot(const Vec3& a, const Vec3& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

constexpr Vec3 cross(const Vec3& a, const Vec3& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

constexpr Vec3 minus(const Vec3& a, const Vec3& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

inline double length(const Vec3& a) {
    return std::sqrt(dot(a, a));
}

constexpr Vec3 scaled(const Vec3& a, double factor) {
    return {a[0] * factor, a[1] * factor, a[2] * factor};
}

constexpr Vec3 product(const Mat3& m, const Vec3& v) {
    return {dot(m[0], v), dot(m[1], v), dot(m[2], v)};
}

constexpr Mat3 transposed(const Mat3& m) {
    return {
        {{m[0][0], m[1][0], m[2][0]}, {m[0][1], m[1][1], m[2][1]}, {m[0][2], m[1][2], m[2][2]}}};
}

constexpr double determinant(const Mat3& m) {
    return dot(m[0], cross(m[1], m[2]));
}

/// Inverse of a matrix that is not singular.
constexpr Mat3 inverse(const Mat3& m) {
    const double scale = 1 / determinant(m);
    return transposed({scaled(cross(m[1], m[2]), scale), scaled(cross(m[2], m[0]), scale),
                       scaled(cross(m[0], m[1]), scale)});
}

/// Hamilton product: the rotation b, then the rotation a.
constexpr Quaternion product(const Quaternion& a, const Quaternion& b) {
    return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
            a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
            a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}

/// The matrix of a quaternion of length 1.
constexpr Mat3 rotation_matrix(const Quaternion& q) {
    const auto [w, x, y, z] = q;
    return {{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
             {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
             {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}}};
}

}  // namespace splat::scene

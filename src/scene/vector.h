#pragma once

// GLM in double precision, as all of the library includes it: its matrices are columns, m[column][row]. Components are
// counted by std::size_t, vectors have no names but x, y and z, and quaternions lie as w, x, y, z.
#define GLM_FORCE_SIZE_T_LENGTH
#define GLM_FORCE_XYZW_ONLY
#define GLM_FORCE_QUAT_DATA_WXYZ
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/matrix.hpp>
#include <glm/vec2.hpp>

namespace splat::scene {

using Vec3 = glm::dvec3;
using Mat3 = glm::dmat3;
using Quaternion = glm::dquat;
using Mat4 = std::array<double, 16>;  ///< row-major, as files and the C API hold poses

inline bool is_finite(const Vec3& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// The adjugate, whose quotient by the determinant is the inverse. Zeros have the signs of the products, unlike in
/// glm::inverse.
inline Mat3 adjugate(const Mat3& m) {
    return glm::transpose(
        Mat3(glm::cross(m[1], m[2]), glm::cross(m[2], m[0]), glm::cross(m[0], m[1])));
}

/// The length, summed in order; glm::length() adds in pairs, which rounds otherwise.
inline double length_of(const Quaternion& q) {
    return std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
}

}  // namespace splat::scene

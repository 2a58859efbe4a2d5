#include "data/relative_pose.h"

namespace splat::data {
namespace {

using scene::Mat3;
using scene::Mat4;
using scene::Vec3;

Mat3 rotation_of(const Mat4& m) {
    return {{{m[0], m[1], m[2]}, {m[4], m[5], m[6]}, {m[8], m[9], m[10]}}};
}

/// Inverse of an affine map; its last row is assumed to be 0 0 0 1.
Result<Mat4> inverse(const Mat4& m) {
    const Mat3 a = rotation_of(m);
    const double volume = scene::determinant(a);
    if (!std::isfinite(volume) || std::abs(volume) < 1e-12)
        return error(Code::kFormat, "a pose is singular or not finite (determinant %g)", volume);
    const Vec3 columns[] = {scene::cross(a[1], a[2]), scene::cross(a[2], a[0]),
                            scene::cross(a[0], a[1])};
    const Vec3 t = {m[3], m[7], m[11]};
    Mat4 out{};
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            out[i * 4 + j] = columns[j][i] / volume;
            out[i * 4 + 3] -= out[i * 4 + j] * t[j];
        }
    }
    out[15] = 1;
    return out;
}

Mat4 product(const Mat4& a, const Mat4& b) {
    Mat4 out{};
    for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t j = 0; j < 4; ++j)
            for (std::size_t k = 0; k < 4; ++k) out[i * 4 + j] += a[i * 4 + k] * b[k * 4 + j];
    return out;
}

constexpr Mat4 kIdentity = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

}  // namespace

scene::Quaternion quaternion_of(const Mat3& m) {
    const double diagonal[] = {m[0][0], m[1][1], m[2][2]};
    const double trace = diagonal[0] + diagonal[1] + diagonal[2];
    // Starts from the largest component, found on the diagonal, to avoid dividing by a small number.
    std::size_t largest = 3;
    double most = trace;
    for (std::size_t i = 0; i < 3; ++i)
        if (diagonal[i] > most) {
            most = diagonal[i];
            largest = i;
        }
    scene::Quaternion q{};
    if (largest == 3) {
        q = {1 + trace, m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]};
    } else {
        const std::size_t i = largest;
        const std::size_t j = (i + 1) % 3;
        const std::size_t k = (i + 2) % 3;
        q[0] = m[k][j] - m[j][k];
        q[1 + i] = 1 + m[i][i] - m[j][j] - m[k][k];
        q[1 + j] = m[j][i] + m[i][j];
        q[1 + k] = m[k][i] + m[i][k];
    }
    double size = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (q[0] < 0) size = -size;
    for (double& component : q) component /= size;
    return q;
}

Status scale_to_distance(double distance, std::span<Mat4> camera_to_world) {
    const Mat4& first = camera_to_world.front();
    const double now = scene::length({first[3], first[7], first[11]});
    if (!(now > 0) || !std::isfinite(now))
        return error(Code::kFormat, "the first camera is at the origin, so the scene has no scale");
    for (Mat4& pose : camera_to_world)
        for (const std::size_t i : {3U, 7U, 11U}) pose[i] *= distance / now;
    return {};
}

double origin_distance(const Mat4& m) {
    return -(m[3] * m[2] + m[7] * m[6] + m[11] * m[10]);
}

Result<std::vector<RelativeView>> relative_views(std::span<const Mat4> camera_to_world) {
    std::vector<RelativeView> views;
    if (camera_to_world.empty()) return views;
    const Mat4& first = camera_to_world.front();
    SPLAT_ASSIGN(const Mat4 to_first, inverse(first));
    for (const Mat4& pose : camera_to_world) {
        if (pose != first) SPLAT_TRY(inverse(pose).status());
        const Mat4 relative = pose == first ? kIdentity : product(to_first, pose);
        RelativeView view;
        for (std::size_t i = 0; i < 4; ++i)
            for (std::size_t j = 0; j < 4; ++j)
                view.view_to_world[j * 4 + i] = static_cast<float>(relative[i * 4 + j]);
        const scene::Quaternion q = quaternion_of(rotation_of(relative));
        for (std::size_t i = 0; i < 4; ++i) view.quaternion[i] = static_cast<float>(q[i]);
        views.push_back(view);
    }
    return views;
}

}  // namespace splat::data

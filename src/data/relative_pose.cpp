#include "data/relative_pose.h"

#include <algorithm>

#include "scene/camera_pose.h"

namespace splat::data {
namespace {

using glm::dmat4;
using scene::Mat3;
using scene::Mat4;
using scene::Vec3;

dmat4 matrix_of(const Mat4& pose) {
    return glm::transpose(glm::make_mat4(pose.data()));
}

/// Inverse of an affine map; its last row is assumed to be 0 0 0 1. Each element is divided: scenes
/// and weights depend on the last bits.
Result<dmat4> inverse(const dmat4& m) {
    const Mat3 a(m);
    const double volume = glm::determinant(a);
    if (!std::isfinite(volume) || std::abs(volume) < 1e-12)
        return damaged("a pose is singular or not finite (determinant %g)", volume);
    dmat4 out(scene::adjugate(a) / volume);
    out[3] -= out * glm::dvec4(Vec3(m[3]), 0);
    return out;
}

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
        q = {1 + trace, m[1][2] - m[2][1], m[2][0] - m[0][2], m[0][1] - m[1][0]};
    } else {
        const std::size_t i = largest;
        const std::size_t j = (i + 1) % 3;
        const std::size_t k = (i + 2) % 3;
        q[0] = m[j][k] - m[k][j];
        q[1 + i] = 1 + m[i][i] - m[j][j] - m[k][k];
        q[1 + j] = m[j][i] + m[i][j];
        q[1 + k] = m[k][i] + m[i][k];
    }
    const double size = scene::length_of(q);
    return q / (q.w < 0 ? -size : size);
}

Status scale_to_distance(double distance, std::span<Mat4> camera_to_world) {
    const Mat4& first = camera_to_world.front();
    const double now = glm::length(scene::translation_of(first));
    if (!(now > 0) || !std::isfinite(now))
        return damaged("the first camera is at the origin, so the scene has no scale");
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
    SPLAT_ASSIGN(const dmat4 to_first, inverse(matrix_of(first)));
    for (const Mat4& pose : camera_to_world) {
        dmat4 relative(1);
        if (pose != first) {
            SPLAT_TRY(inverse(matrix_of(pose)).status());
            relative = to_first * matrix_of(pose) + dmat4(0);  // no zero is negative
        }
        RelativeView view;
        const glm::mat4 columns = relative;
        std::copy_n(glm::value_ptr(columns), 16, view.view_to_world.begin());
        const glm::quat q = quaternion_of(Mat3(relative));
        view.quaternion = {q.w, q.x, q.y, q.z};
        views.push_back(view);
    }
    return views;
}

}  // namespace splat::data

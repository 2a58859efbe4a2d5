#include "scene/camera_pose.h"

#include <algorithm>
#include <numbers>

#include "core/shown.h"

namespace splat::scene {
namespace {

constexpr double kRigidTolerance = 1e-3;

Status check_pose(const Mat4& m) {
    for (const double value : m)
        if (!std::isfinite(value)) return invalid("the matrix is not finite");
    if (m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1)
        return invalid("the last row is %g %g %g %g, expected 0 0 0 1", m[12], m[13], m[14], m[15]);
    const Mat3 r = rotation_of(m);
    const double volume = glm::determinant(r);
    if (volume == 0 || !std::isfinite(volume)) return invalid("the matrix is singular");
    if (volume < 0) return invalid("the matrix mirrors (determinant %g); check its axes", volume);
    const Mat3 products = r * glm::transpose(r);
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) {
            const double expected = i == j ? 1 : 0;
            if (std::abs(products[i][j] - expected) > kRigidTolerance)
                return invalid(
                    "rows %zu and %zu of the rotation have the product %g, expected %g; scale "
                    "the scene instead of its cameras",
                    i, j, products[i][j], expected);
        }
    return {};
}

/// Turns the axes y and z of the space that the pose comes from.
Mat4 flipped(Mat4 pose) {
    for (std::size_t row = 0; row < 3; ++row)
        for (const std::size_t column : {1U, 2U}) pose[row * 4 + column] *= -1;
    return pose;
}

}  // namespace

Mat4 make_pose(const Mat3& r, const Vec3& t) {
    return {r[0][0], r[1][0], r[2][0], t[0], r[0][1], r[1][1], r[2][1], t[1],
            r[0][2], r[1][2], r[2][2], t[2], 0,       0,       0,       1};
}

Mat3 rotation_of(const Mat4& m) {
    return glm::transpose(Mat3(glm::make_mat4(m.data())));
}

Vec3 translation_of(const Mat4& m) {
    return {m[3], m[7], m[11]};
}

Mat4 inverse_pose(const Mat4& m) {
    const Mat3 r = rotation_of(m);
    const Mat3 back = adjugate(r) * (1 / glm::determinant(r));
    return make_pose(back, Vec3() - back * translation_of(m));
}

Mat4 inverse_of_rigid(const Mat4& m) {
    const Mat3 back = glm::transpose(rotation_of(m));
    return make_pose(back, Vec3() - back * translation_of(m));
}

Status check_lens(double fx, double fy, double cx, double cy) {
    if (!std::isfinite(fx) || !std::isfinite(fy) || fx <= 0 || fy <= 0)
        return invalid("focal lengths are %g and %g pixels, expected > 0 and finite", fx, fy);
    if (!std::isfinite(cx) || !std::isfinite(cy))
        return invalid("the principal point is %g, %g and not finite", cx, cy);
    if (std::min(fx, fy) < kLeastFocal || std::max(fx, fy) > kMostFocal)
        return invalid("focal lengths are %g and %g pixels, expected %g to %g; are they in pixels?",
                       fx, fy, kLeastFocal, kMostFocal);
    if (std::max(std::abs(cx), std::abs(cy)) > kMostPrincipal)
        return invalid("the principal point is %g, %g pixels, expected -%g to %g; is it in pixels?",
                       cx, cy, kMostPrincipal, kMostPrincipal);
    return {};
}

Status check_camera(const Camera& c) {
    const auto bad = [&c](const std::string& problem) {
        return invalid("camera '%s': %s", shown(c.name).c_str(), problem.c_str());
    };
    if (c.width < 1 || c.width > kMaxImageSide || c.height < 1 || c.height > kMaxImageSide)
        return bad(format("%u x %u pixels, expected 1 to %u", c.width, c.height, kMaxImageSide));
    const Status lens = check_lens(c.fx, c.fy, c.cx, c.cy);
    if (!lens.ok()) return bad(lens.message());
    const Status pose_status = check_pose(c.world_to_camera);
    return pose_status.ok() ? Status() : bad(pose_status.message());
}

Result<Camera> camera_from_fov(std::uint32_t width, std::uint32_t height, double fov_x) {
    if (!(fov_x > 0 && fov_x < std::numbers::pi))
        return invalid("field of view %g radians, expected 0 to pi", fov_x);
    Camera camera;
    camera.width = width;
    camera.height = height;
    camera.fx = camera.fy = width / (2 * std::tan(fov_x / 2));
    camera.cx = width / 2.0;
    camera.cy = height / 2.0;
    camera.world_to_camera = kNoPose;
    SPLAT_TRY(check_camera(camera));
    return camera;
}

Result<Mat4> look_at(const Vec3& eye, const Vec3& target, const Vec3& up) {
    const Vec3 view = target - eye;
    const double distance = glm::length(view);
    if (!is_finite(eye) || !is_finite(view) || !is_finite(up) || !(distance > 0))
        return invalid("look_at: eye and target coincide, or something is not finite");
    const Vec3 forward = view * (1 / distance);
    const Vec3 side = glm::cross(forward, up);
    if (!(glm::length(side) > 1e-9 * glm::length(up)))
        return invalid("look_at: 'up' is zero or along the view");
    const Vec3 right = side * (1 / glm::length(side));
    const Mat3 axes = {right, glm::cross(forward, right), forward};
    return make_pose(glm::transpose(axes), -(eye * axes));
}

Vec3 camera_center(const Camera& camera) {
    const Mat4& m = camera.world_to_camera;
    return -(translation_of(m) * rotation_of(m));
}

Result<Mat4> opencv_from_opengl(const Mat4& camera_to_world) {
    SPLAT_TRY(check_pose(camera_to_world));
    return inverse_pose(flipped(camera_to_world));
}

Result<Mat4> opengl_from_opencv(const Mat4& world_to_camera) {
    SPLAT_TRY(check_pose(world_to_camera));
    return flipped(inverse_pose(world_to_camera));
}

Result<Mat4> pose_from_quaternion(const Quaternion& q, const Vec3& translation) {
    const double size = length_of(q);
    if (!std::isfinite(size) || size == 0 || !is_finite(translation))
        return invalid("a pose with a quaternion of length %g or a translation that is not finite",
                       size);
    return make_pose(glm::mat3_cast(q / size), translation);
}

}  // namespace splat::scene

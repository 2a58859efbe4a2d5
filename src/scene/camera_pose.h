#pragma once

#include "core/status.h"
#include "scene/camera.h"
#include "scene/vector.h"

namespace splat::scene {

/// The pose of a camera whose axes are those of the world.
inline constexpr Mat4 kNoPose = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

/// A pose of its parts, and the parts of a pose.
Mat4 make_pose(const Mat3& rotation, const Vec3& translation);
Mat3 rotation_of(const Mat4& pose);
Vec3 translation_of(const Mat4& pose);

/// The inverse of a pose that need not be quite rigid, so that there and back is where it was; and that of one whose
/// rotation is taken as exact.
Mat4 inverse_pose(const Mat4& pose);
Mat4 inverse_of_rigid(const Mat4& pose);

/// Largest width and height of a camera.
inline constexpr std::uint32_t kMaxImageSide = 16384;

/// Range of focal lengths, and the largest coordinate of a principal point, in pixels: float32 has fractions of a
/// pixel up to there, and quotients by focal lengths do not overflow.
inline constexpr double kLeastFocal = 1e-6, kMostFocal = 1e9;
inline constexpr double kMostPrincipal = 1 << 20;

/// Errors: kInvalidArgument, naming the field, for what is not finite or out of these ranges.
Status check_lens(double fx, double fy, double cx, double cy);

/// Errors: kInvalidArgument, naming the camera and the field, for width or height 0 or above
/// kMaxImageSide, a lens as in check_lens(), anything not finite, a last row other than
/// 0 0 0 1, and a matrix whose 3x3 part is singular, mirrors, or is not a rotation within 1e-3.
Status check_camera(const Camera& camera);

/// fx, fy, cx, cy of an image of this size whose horizontal field of view is `fov_x` radians; square
/// pixels, principal point in the middle. Errors: kInvalidArgument for an angle outside (0, pi) or a
/// size as in check_camera(). The pose is the identity.
Result<Camera> camera_from_fov(std::uint32_t width, std::uint32_t height, double fov_x);

/// World-to-camera matrix (OpenCV axes) of a camera at `eye` that looks at `target` with `up`, a
/// direction of the world, upwards in the image. Errors: kInvalidArgument if eye and target
/// coincide, `up` is along the view, or anything is not finite.
Result<Mat4> look_at(const Vec3& eye, const Vec3& target, const Vec3& up);

/// Upwards in scenes of the frame RDF.
inline constexpr Vec3 kUp = {0, -1, 0};

/// Position of a valid camera in the world.
Vec3 camera_center(const Camera& camera);

/// OpenGL camera-to-world (x right, y up, z backwards; NeRF's transform_matrix) and OpenCV
/// world-to-camera, row-major 4x4. Errors: kInvalidArgument as check_camera() for the matrix.
Result<Mat4> opencv_from_opengl(const Mat4& camera_to_world);
Result<Mat4> opengl_from_opencv(const Mat4& world_to_camera);

/// World-to-camera matrix of a rotation w, x, y, z (of any length > 0) and a translation, as COLMAP
/// stores it. Errors: kInvalidArgument for a length of 0 or anything not finite.
Result<Mat4> pose_from_quaternion(const Quaternion& rotation, const Vec3& translation);

}  // namespace splat::scene

#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

/// Triangles seen by a pinhole camera: each ray is tried with each triangle.
///
/// With the corners a, b, c in the camera's axes and the ray r = ((x - cx) / fx, (y - cy) / fy, 1), the point t r lies
/// in the triangle if r.(b x c), r.(c x a) and r.(a x b) have one sign; these, divided by their sum, are the weights of
/// the corners, and t = a.(b x c) / sum is its depth.
namespace splat::ref {

using Vec = std::array<double, 3>;

inline Vec cross_of(const Vec& a, const Vec& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double dot_of(const Vec& a, const Vec& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Vec difference_of(const Vec& a, const Vec& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline Vec scaled(const Vec& v, double by) {
    return {v[0] * by, v[1] * by, v[2] * by};
}

struct TriangleCamera {
    double fx = 1, fy = 1, cx = 0, cy = 0;
    std::array<double, 16> world_to_camera{};

    [[nodiscard]] Vec turned(const Vec& v) const {
        const auto& m = world_to_camera;
        return {m[0] * v[0] + m[1] * v[1] + m[2] * v[2], m[4] * v[0] + m[5] * v[1] + m[6] * v[2],
                m[8] * v[0] + m[9] * v[1] + m[10] * v[2]};
    }
    [[nodiscard]] Vec placed(const Vec& v) const {
        const Vec r = turned(v);
        return {r[0] + world_to_camera[3], r[1] + world_to_camera[7], r[2] + world_to_camera[11]};
    }
};

/// One triangle, all about its corners.
struct RefTriangle {
    std::array<Vec, 3> corners{};
    std::optional<std::array<Vec, 3>> normals;  ///< each of length 1
    std::array<std::array<double, 2>, 3> texcoords{};
    std::array<std::array<double, 4>, 3> colors{};  ///< linear, and opacity
    bool double_sided = true;
};

struct RefHit {
    std::size_t triangle = 0;
    double z = 0;
    Vec weights{};
    Vec normal{};       ///< in the world, of length 1, on the side that is seen
    double cosine = 0;  ///< cosine of the angle between the face's normal and the ray
};

struct RefSample {
    std::optional<RefHit> hit;
    double edge = std::numeric_limits<
        double>::infinity();  ///< pixels to the nearest edge of a triangle around there
    double behind = std::numeric_limits<double>::infinity();  ///< depth of the second triangle
};

namespace detail {

inline Vec seen_normal(const RefTriangle& triangle, const Vec& weights, bool front) {
    const Vec face = cross_of(difference_of(triangle.corners[1], triangle.corners[0]),
                              difference_of(triangle.corners[2], triangle.corners[0]));
    const Vec seen = scaled(face, (front ? 1 : -1) / std::sqrt(dot_of(face, face)));
    if (!triangle.normals) return seen;
    Vec sum{};
    for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t axis = 0; axis < 3; ++axis)
            sum[axis] += weights[k] * (*triangle.normals)[k][axis];
    return scaled(sum, (dot_of(sum, seen) < 0 ? -1 : 1) / std::sqrt(dot_of(sum, sum)));
}

}  // namespace detail

/// What the ray through (x, y), in pixels, sees no nearer than `near_plane`.
inline RefSample cast(const std::vector<RefTriangle>& mesh, const TriangleCamera& camera, double x,
                      double y, double near_plane) {
    const Vec ray = {(x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1};
    RefSample sample;
    for (std::size_t i = 0; i < mesh.size(); ++i) {
        std::array<Vec, 3> p{};
        for (std::size_t k = 0; k < 3; ++k) p[k] = camera.placed(mesh[i].corners[k]);
        std::array<double, 3> sides{}, pixels{};  // volumes across the corners; distances to those edges
        double sum = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec plane = cross_of(p[(k + 1) % 3], p[(k + 2) % 3]);
            sides[k] = dot_of(ray, plane);
            pixels[k] = sides[k] / std::hypot(plane[0] / camera.fx, plane[1] / camera.fy);
            sum += sides[k];
        }
        const double sign = sum < 0 ? -1 : 1;
        const double inside = std::min({sign * pixels[0], sign * pixels[1], sign * pixels[2]});
        if (std::isfinite(inside)) sample.edge = std::min(sample.edge, std::abs(inside));
        if (!(inside > 0)) continue;
        const double z = dot_of(p[0], cross_of(p[1], p[2])) / sum;
        const bool front = sum < 0;
        if (!(z >= near_plane) || (!front && !mesh[i].double_sided)) continue;
        if (sample.hit && z >= sample.hit->z) {
            sample.behind = std::min(sample.behind, z);
            continue;
        }
        if (sample.hit) sample.behind = sample.hit->z;
        RefHit hit{.triangle = i, .z = z};
        for (std::size_t k = 0; k < 3; ++k) hit.weights[k] = sides[k] / sum;
        hit.normal = detail::seen_normal(mesh[i], hit.weights, front);
        const Vec face = cross_of(difference_of(p[1], p[0]), difference_of(p[2], p[0]));
        hit.cosine = std::abs(dot_of(face, ray)) / std::sqrt(dot_of(face, face) * dot_of(ray, ray));
        sample.hit = hit;
    }
    return sample;
}

/// The factor of a linear base colour. up, light: of length 1.
inline double light_on(const Vec& normal, const Vec& up, const Vec& light) {
    return 0.35 + 0.25 * (0.5 + 0.5 * dot_of(normal, up)) +
           0.4 * std::max(0.0, dot_of(normal, light));
}

/// Linear texels with opacities, rows from the top. wrap: 0 repeats, 1 clamps, 2 mirrors.
struct RefTexture {
    int width = 0, height = 0;
    std::vector<std::array<double, 4>> texels;
    int wrap_u = 0, wrap_v = 0;
    bool nearest = false;

    static int place(int at, int size, int wrap) {
        if (wrap == 0) return (at % size + size) % size;
        if (wrap == 1) return std::clamp(at, 0, size - 1);
        const int turn = (at % (2 * size) + 2 * size) % (2 * size);
        return turn < size ? turn : 2 * size - 1 - turn;
    }
    [[nodiscard]] const std::array<double, 4>& texel(int x, int y) const {
        return texels[static_cast<std::size_t>(place(y, height, wrap_v) * width +
                                               place(x, width, wrap_u))];
    }
    [[nodiscard]] std::array<double, 4> at(double u, double v) const {
        const double x = u * width - (nearest ? 0 : 0.5), y = v * height - (nearest ? 0 : 0.5);
        const int left = static_cast<int>(std::floor(x)), top = static_cast<int>(std::floor(y));
        if (nearest) return texel(left, top);
        const double right_part = x - left, low_part = y - top;
        std::array<double, 4> sum{};
        for (std::size_t k = 0; k < 4; ++k)
            sum[k] = (1 - low_part) * ((1 - right_part) * texel(left, top)[k] +
                                       right_part * texel(left + 1, top)[k]) +
                     low_part * ((1 - right_part) * texel(left, top + 1)[k] +
                                 right_part * texel(left + 1, top + 1)[k]);
        return sum;
    }
};

}  // namespace splat::ref

#include "synthetic/solid.h"

#include <algorithm>
#include <limits>

#include "core/status.h"

namespace splat::synthetic {
namespace {

using glm::cross;
using glm::dot;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kRoundFace = 100;
constexpr int kCapFace = 101;

Vec3 unit(const Vec3& a) {
    return a * (1 / glm::length(a));
}

/// The part of a ray inside the bounds clipped so far.
struct Interval {
    double in = -kInfinity;
    double out = kInfinity;
    Vec3 normal{};
    int face = 0;

    /// Clip to the half space normal . x <= offset; along the ray it is a + t b <= 0.
    void clip(double a, double b, const Vec3& plane_normal, int plane_face) {
        if (b == 0) {
            if (a > 0) out = -kInfinity;
            return;
        }
        const double t = -a / b;
        if (b > 0) {
            out = std::min(out, t);
        } else if (t > in) {
            in = t;
            normal = plane_normal;
            face = plane_face;
        }
    }
};

/// Clip to y^2 + z^2 <= 1 or x^2 + y^2 + z^2 <= 1 in the solid's own coordinates.
void clip_round(const Solid& solid, const Ray& ray, Interval& part) {
    const Vec3 o = (ray.origin - solid.center) * solid.axes;
    const Vec3 d = ray.direction * solid.axes;
    double a = 0;
    double b = 0;
    double c = -1;
    const std::size_t first = solid.round == Round::kCylinder ? 1 : 0;
    for (std::size_t i = first; i < 3; ++i) {
        const double oi = o[i] / solid.half[i];
        const double di = d[i] / solid.half[i];
        a += di * di;
        b += oi * di;
        c += oi * oi;
    }
    const double discriminant = b * b - a * c;
    if (discriminant < 0 || (a == 0 && c > 0)) {
        part.out = -kInfinity;
        return;
    }
    if (a > 0) {
        const double root = std::sqrt(discriminant);
        const double t = (-b - root) / a;
        part.out = std::min(part.out, (-b + root) / a);
        if (t > part.in) {
            part.in = t;
            part.face = kRoundFace;
            Vec3 gradient{};
            for (std::size_t i = first; i < 3; ++i)
                gradient[i] = (o[i] + t * d[i]) / (solid.half[i] * solid.half[i]);
            part.normal = unit(solid.axes * gradient);
        }
    }
    if (solid.round != Round::kCylinder) return;
    part.clip(o[0] - solid.half[0], d[0], solid.axes[0], kCapFace);
    part.clip(-o[0] - solid.half[0], -d[0], -solid.axes[0], kCapFace + 1);
}

/// The point where three planes meet, if there is exactly one.
std::optional<Vec3> meeting_point(const Plane& a, const Plane& b, const Plane& c) {
    const double volume = dot(a.normal, cross(b.normal, c.normal));
    if (std::abs(volume) < 1e-9) return std::nullopt;
    const Vec3 sum = cross(b.normal, c.normal) * a.offset + cross(c.normal, a.normal) * b.offset +
                     cross(a.normal, b.normal) * c.offset;
    return sum * (1 / volume);
}

std::vector<Vec3> corners(const Solid& solid) {
    std::vector<Vec3> points;
    const std::vector<Plane>& planes = solid.planes;
    for (std::size_t i = 0; i < planes.size(); ++i)
        for (std::size_t j = i + 1; j < planes.size(); ++j)
            for (std::size_t k = j + 1; k < planes.size(); ++k) {
                const auto point = meeting_point(planes[i], planes[j], planes[k]);
                const auto inside = [&point](const Plane& plane) {
                    return dot(plane.normal, *point) <= plane.offset + 1e-9;
                };
                if (point && std::ranges::all_of(planes, inside)) points.push_back(*point);
            }
    return points;
}

}  // namespace

std::optional<Hit> enter(const Solid& solid, const Ray& ray) {
    Interval part;
    if (solid.round != Round::kNone) clip_round(solid, ray, part);
    for (std::size_t i = 0; i < solid.planes.size(); ++i) {
        if (part.in > part.out) return std::nullopt;
        const Plane& plane = solid.planes[i];
        part.clip(dot(plane.normal, ray.origin) - plane.offset, dot(plane.normal, ray.direction),
                  plane.normal, static_cast<int>(i));
    }
    if (part.in > part.out || part.in <= 0) return std::nullopt;
    return Hit{part.in, part.normal, part.face};
}

Solid moved(Solid solid, const Vec3& center, double scale) {
    for (Plane& plane : solid.planes)
        plane.offset = scale * (plane.offset - dot(plane.normal, center));
    solid.center = (solid.center - center) * scale;
    solid.half *= scale;
    return solid;
}

Solid turned(Solid solid, const Mat3& rotation, const Vec3& about) {
    for (Plane& plane : solid.planes) {
        const double from_about = plane.offset - dot(plane.normal, about);
        plane.normal = rotation * plane.normal;
        plane.offset = from_about + dot(plane.normal, about);
    }
    solid.center = about + rotation * (solid.center - about);
    solid.axes = rotation * solid.axes;
    return solid;
}

double support(const Solid& solid, const Vec3& direction) {
    if (solid.round == Round::kNone) {
        double most = -kInfinity;
        for (const Vec3& corner : corners(solid)) most = std::max(most, dot(corner, direction));
        return most;
    }
    const Vec3 e = (direction * solid.axes) * solid.half;
    const double middle = dot(solid.center, direction);
    if (solid.round == Round::kEllipsoid) return middle + glm::length(e);
    return middle + std::abs(e[0]) + std::hypot(e[1], e[2]);
}

double reach(const Solid& solid, const Vec3& center) {
    if (solid.round == Round::kNone) {
        double most = 0;
        for (const Vec3& corner : corners(solid))
            most = std::max(most, glm::length(corner - center));
        return most;
    }
    const double radius = std::max(solid.half[1], solid.half[2]);
    const double own = solid.round == Round::kCylinder ? std::hypot(solid.half[0], radius)
                                                       : std::max(solid.half[0], radius);
    return glm::length(solid.center - center) + own;
}

void find_hull(Solid& solid) {
    if (solid.round == Round::kNone) {
        solid.hull = corners(solid);
        SPLAT_ASSERT(!solid.hull.empty());
        return;
    }
    solid.hull.clear();
    for (unsigned signs = 0; signs < 8; ++signs) {
        Vec3 point = solid.center;
        for (std::size_t i = 0; i < 3; ++i) {
            const double sign = ((signs >> i) & 1U) != 0 ? 1 : -1;
            point += solid.axes[i] * (sign * solid.half[i]);
        }
        solid.hull.push_back(point);
    }
}

Mat3 turn_about(std::size_t axis, double angle) {
    const std::size_t first = (axis + 1) % 3, second = (axis + 2) % 3;
    Mat3 turn(1);
    turn[first][first] = turn[second][second] = std::cos(angle);
    turn[first][second] = std::sin(angle);
    turn[second][first] = -std::sin(angle);
    return turn;
}

Solid make_box(const Vec3& low, const Vec3& high, const Vec3& color, double bevel) {
    Solid solid = make_frustum(low, high, low, high, color);
    if (bevel <= 0) return solid;
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = i + 1; j < 3; ++j)
            for (const double second : {-1.0, 1.0})
                for (const double first : {-1.0, 1.0}) {
                    Vec3 normal{}, point{};
                    normal[i] = first;
                    normal[j] = second;
                    point[i] = first > 0 ? high[i] - bevel : low[i] + bevel;
                    point[j] = second > 0 ? high[j] : low[j];
                    cut(solid, point, normal);
                }
    return solid;
}

Solid make_frustum(const Vec3& low, const Vec3& high, const Vec3& low_top, const Vec3& high_top,
                   const Vec3& color) {
    Solid solid;
    solid.color = color;
    const double height = high[2] - low[2];
    cut(solid, low, {0, 0, -1});
    cut(solid, high, {0, 0, 1});
    for (std::size_t i = 0; i < 2; ++i) {
        Vec3 normal{};
        normal[i] = height;
        normal[2] = high[i] - high_top[i];
        cut(solid, {high[0], high[1], low[2]}, normal);
        normal[i] = -height;
        normal[2] = low_top[i] - low[i];
        cut(solid, low, normal);
    }
    return solid;
}

Solid make_cylinder(const Vec3& from, const Vec3& to, double radius, const Vec3& color) {
    const Vec3 axis = to - from;
    const Vec3 x = unit(axis);
    const Vec3 other = std::abs(x[2]) < 0.9 ? Vec3{0, 0, 1} : Vec3{1, 0, 0};
    const Vec3 y = unit(cross(other, x));
    return {.round = Round::kCylinder,
            .center = (from + to) * 0.5,
            .axes = {x, y, cross(x, y)},
            .half = {glm::length(axis) / 2, radius, radius},
            .color = color};
}

Solid make_ellipsoid(const Vec3& center, const Vec3& half, const Vec3& color) {
    return {.round = Round::kEllipsoid, .center = center, .half = half, .color = color};
}

void cut(Solid& solid, const Vec3& point, const Vec3& normal) {
    const Vec3 n = unit(normal);
    solid.planes.push_back({n, dot(n, point)});
}

}  // namespace splat::synthetic

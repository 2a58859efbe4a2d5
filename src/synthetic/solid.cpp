#include "synthetic/solid.h"

#include <algorithm>
#include <array>
#include <limits>

#include "core/status.h"

namespace splat::synthetic {
namespace {

using scene::cross;
using scene::dot;
using scene::minus;
using scene::product;
using scene::scaled;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kRoundFace = 100;
constexpr int kCapFace = 101;

Vec3 plus(const Vec3& a, const Vec3& b) {
    return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}

Vec3 unit(const Vec3& a) {
    return scaled(a, 1 / scene::length(a));
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
    const Vec3 o = product(solid.axes, minus(ray.origin, solid.center));
    const Vec3 d = product(solid.axes, ray.direction);
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
            part.normal = unit(product(scene::transposed(solid.axes), gradient));
        }
    }
    if (solid.round != Round::kCylinder) return;
    part.clip(o[0] - solid.half[0], d[0], solid.axes[0], kCapFace);
    part.clip(-o[0] - solid.half[0], -d[0], scaled(solid.axes[0], -1), kCapFace + 1);
}

/// The point where three planes meet, if there is exactly one.
std::optional<Vec3> meeting_point(const Plane& a, const Plane& b, const Plane& c) {
    const double volume = dot(a.normal, cross(b.normal, c.normal));
    if (std::abs(volume) < 1e-9) return std::nullopt;
    const Vec3 sum = plus(plus(scaled(cross(b.normal, c.normal), a.offset),
                               scaled(cross(c.normal, a.normal), b.offset)),
                          scaled(cross(a.normal, b.normal), c.offset));
    return scaled(sum, 1 / volume);
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
                if (point && std::all_of(planes.begin(), planes.end(), inside))
                    points.push_back(*point);
            }
    return points;
}

void add_plane(Solid& solid, const Vec3& normal, const Vec3& point) {
    const Vec3 n = unit(normal);
    solid.planes.push_back({n, dot(n, point)});
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
    solid.center = scaled(minus(solid.center, center), scale);
    solid.half = scaled(solid.half, scale);
    return solid;
}

Solid turned(Solid solid, const Mat3& rotation, const Vec3& about) {
    for (Plane& plane : solid.planes) {
        const double from_about = plane.offset - dot(plane.normal, about);
        plane.normal = product(rotation, plane.normal);
        plane.offset = from_about + dot(plane.normal, about);
    }
    solid.center = plus(about, product(rotation, minus(solid.center, about)));
    for (Vec3& axis : solid.axes) axis = product(rotation, axis);
    return solid;
}

double support(const Solid& solid, const Vec3& direction) {
    if (solid.round == Round::kNone) {
        double most = -kInfinity;
        for (const Vec3& corner : corners(solid)) most = std::max(most, dot(corner, direction));
        return most;
    }
    const Vec3 d = product(solid.axes, direction);
    const Vec3 e = {d[0] * solid.half[0], d[1] * solid.half[1], d[2] * solid.half[2]};
    const double middle = dot(solid.center, direction);
    if (solid.round == Round::kEllipsoid) return middle + scene::length(e);
    return middle + std::abs(e[0]) + std::hypot(e[1], e[2]);
}

double reach(const Solid& solid, const Vec3& center) {
    if (solid.round == Round::kNone) {
        double most = 0;
        for (const Vec3& corner : corners(solid))
            most = std::max(most, scene::length(minus(corner, center)));
        return most;
    }
    const double radius = std::max(solid.half[1], solid.half[2]);
    const double own = solid.round == Round::kCylinder ? std::hypot(solid.half[0], radius)
                                                       : std::max(solid.half[0], radius);
    return scene::length(minus(solid.center, center)) + own;
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
            point = plus(point, scaled(solid.axes[i], sign * solid.half[i]));
        }
        solid.hull.push_back(point);
    }
}

Mat3 about_x(double angle) {
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    return {{{1, 0, 0}, {0, c, -s}, {0, s, c}}};
}

Mat3 about_y(double angle) {
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    return {{{c, 0, s}, {0, 1, 0}, {-s, 0, c}}};
}

Mat3 about_z(double angle) {
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    return {{{c, -s, 0}, {s, c, 0}, {0, 0, 1}}};
}

Solid make_box(const Vec3& low, const Vec3& high, const Vec3& color, double bevel) {
    Solid solid = make_frustum(low, high, low, high, color);
    if (bevel <= 0) return solid;
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = i + 1; j < 3; ++j)
            for (const int signs : {0, 1, 2, 3}) {
                const bool first = (signs & 1) != 0;
                const bool second = (signs & 2) != 0;
                Vec3 normal{};
                Vec3 point{};
                normal[i] = first ? 1 : -1;
                normal[j] = second ? 1 : -1;
                point[i] = first ? high[i] - bevel : low[i] + bevel;
                point[j] = second ? high[j] : low[j];
                cut(solid, point, normal);
            }
    return solid;
}

Solid make_frustum(const Vec3& low, const Vec3& high, const Vec3& low_top, const Vec3& high_top,
                   const Vec3& color) {
    Solid solid;
    solid.color = color;
    const double height = high[2] - low[2];
    add_plane(solid, {0, 0, -1}, low);
    add_plane(solid, {0, 0, 1}, high);
    for (std::size_t i = 0; i < 2; ++i) {
        Vec3 normal{};
        normal[i] = height;
        normal[2] = high[i] - high_top[i];
        add_plane(solid, normal, {high[0], high[1], low[2]});
        normal[i] = -height;
        normal[2] = low_top[i] - low[i];
        add_plane(solid, normal, low);
    }
    return solid;
}

Solid make_cylinder(const Vec3& from, const Vec3& to, double radius, const Vec3& color) {
    Solid solid;
    solid.round = Round::kCylinder;
    solid.color = color;
    solid.center = scaled(plus(from, to), 0.5);
    const Vec3 axis = minus(to, from);
    solid.half = {scene::length(axis) / 2, radius, radius};
    const Vec3 x = unit(axis);
    const Vec3 other = std::abs(x[2]) < 0.9 ? Vec3{0, 0, 1} : Vec3{1, 0, 0};
    const Vec3 y = unit(cross(other, x));
    solid.axes = {x, y, cross(x, y)};
    return solid;
}

Solid make_ellipsoid(const Vec3& center, const Vec3& half, const Vec3& color) {
    Solid solid;
    solid.round = Round::kEllipsoid;
    solid.color = color;
    solid.center = center;
    solid.half = half;
    return solid;
}

void cut(Solid& solid, const Vec3& point, const Vec3& normal) {
    add_plane(solid, normal, point);
}

}  // namespace splat::synthetic

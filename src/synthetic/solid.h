#pragma once

#include <optional>
#include <vector>

#include "scene/vector.h"

namespace splat::synthetic {

using scene::Mat3;
using scene::Vec3;

/// The points x with normal . x <= offset; the normal has length 1.
struct Plane {
    Vec3 normal;
    double offset = 0;
};

/// The round part of a solid, in its own axes divided by `half`: y^2 + z^2 <= 1 (with
/// |x| <= 1), or x^2 + y^2 + z^2 <= 1.
enum class Round { kNone, kCylinder, kEllipsoid };

/// A convex solid of one colour: the points inside all of its planes and its round part.
struct Solid {
    std::vector<Plane> planes{};
    Round round = Round::kNone;
    Vec3 center{};       ///< centre of the round part
    Mat3 axes{1};        ///< columns
    Vec3 half{1, 1, 1};  ///< half length and radii along the axes
    Vec3 color{1, 1, 1};
    std::vector<Vec3> hull{};  ///< points whose convex hull contains the solid; set by find_hull()
};

struct Ray {
    Vec3 origin{};
    Vec3 direction{};  ///< any length > 0, the unit of distances
};

struct Hit {
    double distance = 0;
    Vec3 normal{};  ///< unit vector, outwards
    int face = 0;   ///< equal on one smooth face of a solid
};

/// The point where a ray enters the solid, exact up to rounding. Nothing if the ray misses or starts inside.
std::optional<Hit> enter(const Solid& solid, const Ray& ray);

/// The solid moved by -center and then scaled.
Solid moved(Solid solid, const Vec3& center, double scale);

/// The solid turned by a rotation about a point.
Solid turned(Solid solid, const Mat3& rotation, const Vec3& about);

/// The largest product of `direction` and a point of the solid. An upper bound for a round part that
/// planes cut: the planes are ignored.
double support(const Solid& solid, const Vec3& direction);

/// An upper bound of the distance of its points from `center`; exact without a round part.
double reach(const Solid& solid, const Vec3& center);

/// Sets `hull`.
void find_hull(Solid& solid);

/// The rotation about x, y or z (0, 1, 2), counterclockwise seen from its tip, in radians.
Mat3 turn_about(std::size_t axis, double angle);

/// A box with edges along the axes, whose 12 edges are cut off at 45 degrees `bevel` from the corner.
Solid make_box(const Vec3& low, const Vec3& high, const Vec3& color, double bevel = 0);

/// A box whose top is the rectangle low_top to high_top (x and y).
Solid make_frustum(const Vec3& low, const Vec3& high, const Vec3& low_top, const Vec3& high_top,
                   const Vec3& color);

/// A cylinder from one point to another.
Solid make_cylinder(const Vec3& from, const Vec3& to, double radius, const Vec3& color);

Solid make_ellipsoid(const Vec3& center, const Vec3& half, const Vec3& color);

/// Cut off the side of the plane through `point` to which `normal` points.
void cut(Solid& solid, const Vec3& point, const Vec3& normal);

}  // namespace splat::synthetic

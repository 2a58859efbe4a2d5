#pragma once

#include <array>
#include <string>
#include <string_view>

#include "scene/vector.h"

namespace splat::scene {

using Vec2 = glm::dvec2;

/// What a lens does to a ray at distance r from the axis in the plane z = 1, before its polynomial.
enum class LensKind {
    kPerspective,  ///< nothing
    kFisheye,      ///< moves it to the distance atan(r)
    kFov,          ///< moves it to the distance atan(2 r tan(omega / 2)) / omega
};

/// The distortion of a lens, in one form for all models of COLMAP and of transforms.json files. At (u,v), where the
/// kind puts a ray, with s = u^2 + v^2:
///   u (1 + k1 s + k2 s^2 + k3 s^3 + k4 s^4) / (1 + d1 s + d2 s^2 + d3 s^3) + 2 p1 u v + p2 (s + 2 u^2) + sx s
///   v (the same)                                                         + 2 p2 u v + p1 (s + 2 v^2) + sy s
struct Lens {
    LensKind kind = LensKind::kPerspective;
    std::array<double, 4> radial{};       ///< k1 to k4
    std::array<double, 3> denominator{};  ///< d1 to d3: k4 to k6 of OpenCV's rational model
    std::array<double, 2> tangential{};   ///< p1, p2
    std::array<double, 2> prism{};        ///< sx, sy
    double omega = 0;                     ///< the angle of view of kFov, radians

    bool operator==(const Lens&) const = default;
};

/// True if distort() returns what it gets.
bool is_pinhole(const Lens& lens);

/// Sets a parameter by its name in COLMAP's models: k, k1 to k6, p1, p2, sx1, sy1, omega; k4 to k6 of a perspective
/// lens are those of the denominator. Returns false for another name.
bool set_parameter(Lens& lens, std::string_view name, double value);

/// Kind and parameters that are not zero, for messages: "fisheye k1 = 0.1, k2 = -0.02".
std::string lens_text(const Lens& lens);

/// Where the lens puts what a pinhole puts at a place; both in the plane z = 1: pixels are at fx x + cx, fy y + cy.
///
/// Precision    float64
/// Source       COLMAP's documentation, "Camera Models", and OpenCV's, "Camera Calibration", for the equations;
///              Devernay and Faugeras, Straight lines have to be straight, 2001, for kFov
Vec2 distort(const Lens& lens, const Vec2& place);

/// The distance r from the axis up to which a farther place goes to a farther place, without tangential terms: beyond
/// it a polynomial folds back, and what a pinhole sees there is not in the photograph. At most `most`, with an error of
/// at most a thousandth of that.
double unfolded_radius(const Lens& lens, double most);

}  // namespace splat::scene

#include "scene/view_places.h"

#include <numbers>

namespace splat::scene {
namespace {

constexpr double kTurns = 4;
/// Where on the spiral the front is at 45 degrees.
constexpr double kFront = 64.0 / 251;
constexpr double kTop = 0.999;  ///< "up" is undefined at the pole

}  // namespace

Vec3 direction_at(double height, double azimuth) {
    const double flat = std::sqrt(1 - height * height);
    return {flat * std::cos(azimuth), flat * std::sin(azimuth), height};
}

Vec3 spiral_direction(std::uint32_t view, std::uint32_t count) {
    const double part = (view + 0.5) / count;
    const double height = std::sin(part * std::numbers::pi / 2 * kTop);
    return direction_at(height, 2 * std::numbers::pi * (kTurns * (part - kFront) + 0.125));
}

}  // namespace splat::scene

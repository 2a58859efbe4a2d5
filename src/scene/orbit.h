#pragma once

#include <vector>

#include "core/status.h"
#include "scene/camera.h"
#include "scene/camera_pose.h"
#include "scene/gaussians.h"

namespace splat::scene {

struct OrbitOptions {
    std::uint32_t count = 60;
    std::uint32_t width = 512;
    std::uint32_t height = 512;
    double fov_x = 0.7;      ///< radians
    double elevation = 0.2;  ///< radians above the horizon
    double start = 0;     ///< angle of the first camera; 0: in front of the scene, looking along +z
    double distance = 0;  ///< from the middle of the scene's body; 0: the body fills the images
    Vec3 up = kUp;
};

/// Share of half an image that an orbit without a distance fills; the rest is a margin.
inline constexpr double kOrbitFill = 0.95;

/// The part of a scene that its orbit shows: visible Gaussians (opacity of at least 1/255) whose means are finite and
/// not farther from the median of the means than kBodyRadii times the radius that holds 98 % of the opacity. What lies
/// farther, such as a sky or a few stray Gaussians, would make the rest small. Where none is visible, all count.
inline constexpr double kBodyRadii = 1.5;
struct Body {
    std::vector<Vec3> means;
    Vec3 middle{};  ///< middle of the bounds of the means, axis by axis; zero without means
};
Body body_of(const Gaussians& gaussians);

/// Cameras at equal angles on a circle around the middle of a scene's body. Without a distance the circle is the
/// smallest, of any number of cameras, from all of which the means of the body lie within kOrbitFill of the image.
/// Errors: kInvalidArgument for invalid options, or for a body without extent if no distance is given.
Result<std::vector<Camera>> orbit(const Gaussians& gaussians, const OrbitOptions& options = {});

}  // namespace splat::scene

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "raster/raster_case.h"

/// Synthetic scenes of any size for tests and benchmarks, with the same numbers on every machine.
///
/// By default a ball of Gaussians around the origin of the world that fills the view of a slightly
/// turned camera 4 units away.
namespace splat::test {

struct SceneSize {
    std::size_t count = 100;
    std::size_t width = 64;
    std::size_t height = 48;
};

/// Anisotropic Gaussians of all opacities, spherical harmonics of the degree; some colours hit the
/// clamp at 0. Scales shrink with the count, so that the depth complexity stays alike.
RasterCase random_scene(const SceneSize& size, std::uint64_t seed, std::size_t sh_degree = 1);

/// Needles: one axis of about a unit times `length`, the other two shorter by up to 1e4 and more.
/// There det = a c - b^2 cancels.
RasterCase needle_scene(const SceneSize& size, std::uint64_t seed, double length = 1);

/// Four layers of exactly equal depth, camera without rotation: blended in ascending index.
RasterCase tie_scene(const SceneSize& size, std::uint64_t seed);

/// random_scene in which every second Gaussian is invalid: numbers that are not finite, rotations
/// of no length, opacities that are not positive, means at and behind the camera. `hostile` is [n].
struct HostileScene {
    RasterCase with;
    RasterCase without;  ///< the others only
    std::vector<bool> hostile;
};
HostileScene hostile_scene(const SceneSize& size, std::uint64_t seed);

/// One Gaussian per pixel of a source view of side `side`: opaque on a disc, nearly transparent
/// around it (most of them below 1/255), degree 1, white background, seen from another side.
RasterCase splatter_scene(std::size_t side, std::size_t width, std::size_t height,
                          std::uint64_t seed);

/// Many dense Gaussians behind each other: alpha is clamped and pixels stop early everywhere.
RasterCase opaque_scene(const SceneSize& size, std::uint64_t seed);

/// Large Gaussians far outside the field of view, where the Jacobian is clamped.
RasterCase wide_scene(const SceneSize& size, std::uint64_t seed);

/// `count` Gaussians behind the camera, so that only the background is visible. `count` may be 0.
RasterCase empty_scene(const SceneSize& size);

/// Loss weights: normal numbers, 0 on fragile pixels.
std::vector<float> loss_weights(const std::vector<bool>& fragile, std::size_t channels,
                                std::uint64_t seed);

}  // namespace splat::test

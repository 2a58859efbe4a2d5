#pragma once

#include <cstddef>
#include <vector>

#include "core/status.h"
#include "scene/gaussians.h"
#include "scene/vector.h"

namespace splat::scene {

/// An axis-aligned box; the faces belong to it.
struct Box {
    Vec3 low{};
    Vec3 high{};
};

/// The means that are finite, in their order.
std::vector<Vec3> finite_means(const Gaussians& gaussians);

/// The least box that holds the points; zero without any.
Box bounds_of(const std::vector<Vec3>& points);

/// The Gaussians whose mean is in the box, in their order; means that are not finite are outside.
/// Errors: kInvalidArgument for a box whose low corner is not below the high one, or as
/// check_arrays().
Result<Gaussians> crop(const Gaussians& gaussians, const Box& box);

/// The Gaussians whose mean is at most `radius` from `center`, in their order; means that are not finite are outside.
/// Errors: kInvalidArgument for a centre that is not finite or a radius that is not >= 0, or as check_arrays().
Result<Gaussians> crop_sphere(const Gaussians& gaussians, const Vec3& center, double radius);

/// The Gaussians whose opacity is >= this one (0 to 1), in their order; a logit of NaN is below every opacity.
/// Errors: kInvalidArgument.
Result<Gaussians> filter_by_opacity(const Gaussians& gaussians, double least);

/// The Gaussians without NaN, infinities and rotations of length 0, in their order.
/// Errors: kInvalidArgument.
Result<Gaussians> remove_invalid(const Gaussians& gaussians);

/// All Gaussians of the scenes, one scene after the other, with the highest of their degrees; the
/// bands that a scene lacks are zeros. Drawn as the first one. Errors: kInvalidArgument.
Result<Gaussians> merge(const std::vector<Gaussians>& scenes);

/// The indices of the Gaussians along a Morton curve through their bounds: neighbours in space become
/// neighbours. Gaussians at equal places keep their order; means that are not finite come last.
std::vector<std::size_t> morton_order(const Gaussians& gaussians);

/// The Gaussians in their Morton order. Errors: kInvalidArgument.
Result<Gaussians> sort_morton(const Gaussians& gaussians);

}  // namespace splat::scene

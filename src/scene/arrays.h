#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/status.h"
#include "scene/gaussians.h"
#include "scene/vector.h"

namespace splat::scene {

/// One of the arrays of a set of Gaussians.
struct Attribute {
    const char* name;
    std::vector<float> Gaussians::*array;
    std::size_t each;  ///< numbers of one Gaussian
};

/// All of them, in the order of the struct.
std::array<Attribute, 5> attributes(std::uint32_t sh_degree);

/// "antialiased", "by distance", "3 sigma", "linear colours": those that are set.
std::vector<std::string> drawn_as_names(const DrawnAs& drawn_as);

/// The rotation of Gaussian i, as it is stored.
Quaternion rotation_at(const Gaussians& gaussians, std::size_t i);

/// Errors: kInvalidArgument if the degree is above kMaxShDegree or the length of an array does not
/// fit the count and the degree; names the array.
Status check_arrays(const Gaussians& gaussians);

/// n Gaussians of this degree, all zeros.
Gaussians make_gaussians(std::size_t count, std::uint32_t sh_degree);

/// Change the number of Gaussians; new ones are all zeros.
void resize(Gaussians& gaussians, std::size_t count);

/// No Gaussians of this degree, with room for `count`: memory is taken as resize() fills it.
Gaussians reserve_gaussians(std::size_t count, std::uint32_t sh_degree);

/// A copy of `count` Gaussians from Gaussian `first` on.
Gaussians part(const Gaussians& gaussians, std::size_t first, std::size_t count);

/// The Gaussians of these indices, in this order. Indices are below the count.
Gaussians gather(const Gaussians& gaussians, const std::vector<std::size_t>& indices);

/// Change the degree: bands are dropped, or added as zeros. The other arrays stay where they are.
void set_sh_degree(Gaussians& gaussians, std::uint32_t sh_degree);

/// The same Gaussians with another degree: bands are dropped, or added as zeros.
Gaussians with_sh_degree(Gaussians gaussians, std::uint32_t sh_degree);

/// Scale every rotation to length 1. One of length 1 within 1e-6 keeps its bits, so that a file
/// stays the same when it is read and written again. Rotations of length 0 or not finite are kept;
/// returns their number.
std::size_t normalise_rotations(Gaussians& gaussians);

}  // namespace splat::scene

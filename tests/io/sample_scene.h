#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "io/bytes.h"
#include "scene/gaussians.h"

namespace splat::test {

/// Random Gaussians of this degree that every format can hold: means within +-4, log scales -6 to 1,
/// colours and bands within +-1, unit rotations, logits +-4. The same for the same seed.
scene::Gaussians sample_scene(std::size_t count, std::uint32_t sh_degree, std::uint32_t seed = 1);

/// Largest difference of an attribute, element by element; infinity if the lengths differ.
double max_difference(const std::vector<float>& a, const std::vector<float>& b);

/// Largest angle in radians between rotations of the same index, whatever their sign.
double max_angle(const std::vector<float>& a, const std::vector<float>& b);

/// The arrays have the same bits.
void expect_same_bits(const scene::Gaussians& a, const scene::Gaussians& b);

/// True if a parser accepted the bytes. It must not crash on any bytes.
using Accepts = std::function<bool(io::Bytes)>;

/// Every proper prefix of the file is refused.
void expect_prefixes_refused(const io::Buffer& file, const Accepts& accepts);

/// Parse the file once for each byte set to 0, set to 255, and with one bit flipped.
void parse_damaged(const io::Buffer& file, const Accepts& accepts);

/// Both of these.
inline void expect_sturdy(const io::Buffer& file, const Accepts& accepts) {
    expect_prefixes_refused(file, accepts);
    parse_damaged(file, accepts);
}

io::Buffer bytes_of(const std::string& text);

}  // namespace splat::test

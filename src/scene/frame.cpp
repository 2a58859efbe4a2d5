#include "scene/frame.h"

#include <array>

#include "scene/sh.h"

namespace splat::scene {
namespace {

constexpr std::array<const char*, 8> kFrameNames = {"RDF", "RUB", "LUF", "RUF",
                                                    "LDB", "RDB", "LUB", "LDF"};

using Signs = std::array<float, 3>;

/// -1 for each axis that points the other way.
Signs axis_signs(Frame from, Frame to) {
    Signs signs{};
    for (std::size_t axis = 0; axis < 3; ++axis)
        signs[axis] = frame_name(from)[axis] == frame_name(to)[axis] ? 1.0F : -1.0F;
    return signs;
}

/// Sign of each basis function under the mirrors: functions are even or odd in x, y and z.
std::array<float, kMaxShCoefficients> sh_signs(const Signs& signs) {
    const auto [x, y, z] = signs;
    return {1, y, z, x, x * y, y * z, 1, x * z, 1, y, x * y * z, y, z, x, z, x};
}

}  // namespace

const char* frame_name(Frame frame) {
    return kFrameNames[static_cast<std::size_t>(frame)];
}

void convert_frame(Gaussians& g, Frame from, Frame to) {
    if (from == to) return;
    const Signs signs = axis_signs(from, to);
    for (std::size_t i = 0; i < g.means.size(); ++i) g.means[i] *= signs[i % 3];
    // The mirror F turns the rotation R into F R F, up to signs that the covariance does not see.
    const std::array<float, 4> turn = {1, signs[1] * signs[2], signs[0] * signs[2],
                                       signs[0] * signs[1]};
    for (std::size_t i = 0; i < g.rotations.size(); ++i) g.rotations[i] *= turn[i % 4];
    const auto bands = sh_signs(signs);
    const std::size_t count = sh_coefficients(g.sh_degree);
    for (std::size_t i = 0; i < g.sh.size(); ++i) g.sh[i] *= bands[(i / 3) % count];
}

}  // namespace splat::scene

#include "scene/transform.h"

#include <algorithm>

#include "scene/arrays.h"
#include "scene/sh.h"

namespace splat::scene {
namespace {

double length(const Quaternion& q) {
    return std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
}

Quaternion normalised(const Quaternion& q) {
    const double size = length(q);
    return {q[0] / size, q[1] / size, q[2] / size, q[3] / size};
}

Status check(const Similarity& s) {
    if (const double size = length(s.rotation); !std::isfinite(size) || size == 0)
        return error(Code::kInvalidArgument, "transform: rotation of length %g, expected > 0",
                     size);
    if (!std::isfinite(s.scale) || s.scale <= 0)
        return error(Code::kInvalidArgument, "transform: scale %g, expected > 0", s.scale);
    for (const double value : s.translation)
        if (!std::isfinite(value))
            return error(Code::kInvalidArgument, "transform: the translation is not finite");
    return {};
}

}  // namespace

Status transform(Gaussians& g, const Similarity& s) {
    SPLAT_TRY(check_arrays(g));
    SPLAT_TRY(check(s));
    const Quaternion turn = normalised(s.rotation);
    const Mat3 matrix = rotation_matrix(turn);
    const ShTransform bands(matrix);
    const double log_scale = std::log(s.scale);
    const std::size_t each = std::size_t{sh_coefficients(g.sh_degree)} * 3;
    for (std::size_t i = 0; i < g.count(); ++i) {
        float* const mean = g.means.data() + i * 3;
        float* const rotation = g.rotations.data() + i * 4;
        const Vec3 turned =
            product(matrix, {static_cast<double>(mean[0]), static_cast<double>(mean[1]),
                             static_cast<double>(mean[2])});
        for (std::size_t k = 0; k < 3; ++k)
            mean[k] = static_cast<float>(s.scale * turned[k] + s.translation[k]);
        const Quaternion q = product(
            turn, Quaternion{static_cast<double>(rotation[0]), static_cast<double>(rotation[1]),
                             static_cast<double>(rotation[2]), static_cast<double>(rotation[3])});
        for (std::size_t k = 0; k < 4; ++k) rotation[k] = static_cast<float>(q[k]);
        bands.apply(g.sh.data() + i * each, g.sh_degree);
    }
    for (float& value : g.log_scales)
        value = static_cast<float>(static_cast<double>(value) + log_scale);
    return {};
}

Similarity inverse(const Similarity& s) {
    const Quaternion q = normalised(s.rotation);
    Similarity back;
    back.rotation = {q[0], -q[1], -q[2], -q[3]};
    back.scale = 1 / s.scale;
    back.translation = scaled(product(rotation_matrix(back.rotation), s.translation), -back.scale);
    return back;
}

}  // namespace splat::scene

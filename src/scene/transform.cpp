#include "scene/transform.h"

#include <algorithm>

#include "scene/arrays.h"
#include "scene/sh.h"

namespace splat::scene {
namespace {

/// The largest component: of any length, that can be divided by without an overflow.
double largest(const Quaternion& q) {
    double most = 0;
    for (const double value : q) most = std::max(most, std::abs(value));
    return most;
}

Quaternion normalised(const Quaternion& q) {
    const double most = largest(q);
    Quaternion unit{};
    for (std::size_t i = 0; i < 4; ++i) unit[i] = q[i] / most;
    const double size =
        std::sqrt(unit[0] * unit[0] + unit[1] * unit[1] + unit[2] * unit[2] + unit[3] * unit[3]);
    return {unit[0] / size, unit[1] / size, unit[2] / size, unit[3] / size};
}

Status check(const Similarity& s) {
    bool finite = true;
    for (const double value : s.rotation) finite = finite && std::isfinite(value);
    if (!finite || largest(s.rotation) == 0)
        return error(Code::kInvalidArgument,
                     "transform: rotation %g, %g, %g, %g, expected finite numbers, not all 0",
                     s.rotation[0], s.rotation[1], s.rotation[2], s.rotation[3]);
    if (!std::isfinite(s.scale) || s.scale <= 0)
        return error(Code::kInvalidArgument, "transform: scale %g, expected > 0", s.scale);
    for (const double value : s.translation)
        if (!std::isfinite(value))
            return error(Code::kInvalidArgument, "transform: the translation is not finite");
    return {};
}

/// Errors: kInvalidArgument where a finite one would not stay finite.
Result<decltype(Gaussians::means)> moved_means(const Gaussians& g, const Mat3& matrix,
                                               const Similarity& s) {
    decltype(Gaussians::means) means(g.means.size());
    for (std::size_t i = 0; i < g.count(); ++i) {
        const float* const mean = g.means.data() + i * 3;
        const Vec3 turned =
            product(matrix, {static_cast<double>(mean[0]), static_cast<double>(mean[1]),
                             static_cast<double>(mean[2])});
        for (std::size_t k = 0; k < 3; ++k)
            means[i * 3 + k] = static_cast<float>(s.scale * turned[k] + s.translation[k]);
        bool overflows = false;
        for (std::size_t k = 3 * i; k < 3 * i + 3; ++k)
            overflows = overflows || (std::isfinite(mean[0]) && std::isfinite(mean[1]) &&
                                      std::isfinite(mean[2]) && !std::isfinite(means[k]));
        if (overflows)
            return error(Code::kInvalidArgument,
                         "transform: scale %g and translation %g, %g, %g move Gaussian %zu beyond "
                         "float32; use smaller ones",
                         s.scale, s.translation[0], s.translation[1], s.translation[2], i);
    }
    return means;
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
    SPLAT_ASSIGN(g.means, moved_means(g, matrix, s));
    for (std::size_t i = 0; i < g.count(); ++i) {
        float* const rotation = g.rotations.data() + i * 4;
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

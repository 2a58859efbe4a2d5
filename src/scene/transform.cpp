#include "scene/transform.h"

#include <algorithm>

#include "scene/arrays.h"
#include "scene/sh.h"

namespace splat::scene {
namespace {

/// The largest component: of any length, that can be divided by without an overflow.
double largest(const Quaternion& q) {
    return std::max({std::abs(q.w), std::abs(q.x), std::abs(q.y), std::abs(q.z)});
}

Quaternion normalised(const Quaternion& q) {
    const Quaternion unit = q / largest(q);
    return unit / length_of(unit);
}

/// Hamilton product: the rotation b, then the rotation a. In this order of sums, which decides the last bits of scenes;
/// GLM's is another.
Quaternion product(const Quaternion& a, const Quaternion& b) {
    return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
            a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
            a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
            a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}

Status check(const Similarity& s) {
    if (!std::isfinite(length_of(s.rotation / largest(s.rotation))))
        return invalid("transform: rotation %g, %g, %g, %g, expected finite numbers, not all 0",
                       s.rotation[0], s.rotation[1], s.rotation[2], s.rotation[3]);
    if (!std::isfinite(s.scale) || s.scale <= 0)
        return invalid("transform: scale %g, expected > 0", s.scale);
    if (!is_finite(s.translation)) return invalid("transform: the translation is not finite");
    return {};
}

/// Errors: kInvalidArgument where a finite one would not stay finite.
Result<decltype(Gaussians::means)> moved_means(const Gaussians& g, const Mat3& matrix,
                                               const Similarity& s) {
    decltype(Gaussians::means) means(g.means.size());
    for (std::size_t i = 0; i < g.count(); ++i) {
        const Vec3 mean = glm::make_vec3(&g.means[i * 3]);
        const glm::vec3 moved = s.scale * (matrix * mean) + s.translation;
        std::copy_n(glm::value_ptr(moved), 3, &means[i * 3]);
        if (is_finite(mean) && !is_finite(moved))
            return invalid(
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
    const Mat3 matrix = glm::mat3_cast(turn);
    const ShTransform bands(matrix);
    const double log_scale = std::log(s.scale);
    const std::size_t each = std::size_t{sh_coefficients(g.sh_degree)} * 3;
    SPLAT_ASSIGN(g.means, moved_means(g, matrix, s));
    for (std::size_t i = 0; i < g.count(); ++i) {
        const glm::quat q = product(turn, rotation_at(g, i));
        std::copy_n(&q.w, 4, &g.rotations[4 * i]);
        bands.apply(g.sh.data() + i * each, g.sh_degree);
    }
    for (float& value : g.log_scales)
        value = static_cast<float>(static_cast<double>(value) + log_scale);
    return {};
}

}  // namespace splat::scene

#include "prior_scores/normal_scores.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "prior_scores/check_map.h"
#include "scene/vector.h"

namespace splat::prior_scores {
namespace {

constexpr double kLeastLength = 0.5;

scene::Vec3 normal_at(std::span<const float> map, std::size_t pixel) {
    const std::size_t pixels = map.size() / 3;
    return {static_cast<double>(map[pixel]), static_cast<double>(map[pixels + pixel]),
            static_cast<double>(map[2 * pixels + pixel])};
}

/// Degrees; exact for small angles, unlike the arc cosine.
double angle_between(const scene::Vec3& a, const scene::Vec3& b) {
    return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)) * 180 / std::numbers::pi;
}

double median_of(std::vector<double>& angles) {
    const std::size_t middle = angles.size() / 2;
    const auto at = angles.begin() + static_cast<std::ptrdiff_t>(middle);
    std::nth_element(angles.begin(), at, angles.end());
    if (angles.size() % 2 != 0) return *at;
    return (*at + *std::max_element(angles.begin(), at)) / 2;
}

/// The angle of each pixel that counts.
Result<std::vector<double>> angles_of(std::span<const float> prediction,
                                      std::span<const float> truth, std::span<const float> mask,
                                      std::uint64_t& missing) {
    std::vector<double> angles;
    for (std::size_t i = 0; i < truth.size() / 3; ++i) {
        if (!mask.empty() && !(mask[i] > 0.5F)) continue;
        const scene::Vec3 p = normal_at(prediction, i);
        const scene::Vec3 g = normal_at(truth, i);
        if (!scene::is_finite(p) || !scene::is_finite(g))
            return invalid("a normal of pixel %zu is not finite; leave such pixels out with a mask",
                           i);
        if (glm::length(g) < kLeastLength) {
            if (mask.empty()) continue;
            return invalid(
                "the true normal of pixel %zu, inside of the mask, has the length %g, "
                "expected about 1",
                i, glm::length(g));
        }
        const bool none = glm::length(p) < kLeastLength;
        if (none) ++missing;
        angles.push_back(none ? 180 : angle_between(p, g));
    }
    return angles;
}

}  // namespace

Result<NormalScores> compare_normals(std::span<const float> prediction,
                                     std::span<const float> truth, std::span<const float> mask) {
    if (truth.size() % 3 != 0 || prediction.size() != truth.size() ||
        (!mask.empty() && mask.size() != truth.size() / 3))
        return error(Code::kShape,
                     "the predicted normals have %zu numbers, the true ones %zu and the mask %zu, "
                     "expected 3 for each pixel, and 1 of the mask",
                     prediction.size(), truth.size(), mask.size());
    NormalScores scores;
    SPLAT_ASSIGN(std::vector<double> angles, angles_of(prediction, truth, mask, scores.missing));
    if (angles.empty())
        return invalid("no pixel counts: %s",
                       mask.empty() ? "there is no true normal" : "the mask is nowhere > 0.5");
    double sum = 0, squares = 0;
    constexpr double kAngles[] = {11.25, 22.5, 30};
    for (const double angle : angles) {
        sum += angle;
        squares += angle * angle;
        for (std::size_t k = 0; k < 3; ++k)
            if (angle < kAngles[k]) scores.within[k] += 1;
    }
    const auto n = static_cast<double>(angles.size());
    scores.pixels = angles.size();
    scores.mean = sum / n;
    scores.rmse = std::sqrt(squares / n);
    for (double& share : scores.within) share /= n;
    scores.median = median_of(angles);
    return scores;
}

}  // namespace splat::prior_scores

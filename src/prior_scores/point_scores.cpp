#include "prior_scores/point_scores.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "scene/nearest_points.h"

namespace splat::prior_scores {
namespace {

constexpr std::size_t kBlock = 4096;  ///< points of a thread's turn

Status check_points(std::span<const scene::Vec3> points, const char* name) {
    if (points.empty()) return invalid("there are no %s points", name);
    for (std::size_t i = 0; i < points.size(); ++i)
        if (!scene::is_finite(points[i])) return invalid("%s point %zu is not finite", name, i);
    return {};
}

/// Means of one direction.
struct Distances {
    double mean = 0, squared = 0, near = 0;
};

Result<Distances> distances_of(std::span<const scene::Vec3> from, std::span<const scene::Vec3> to,
                               double threshold) {
    const scene::NearestPoints tree(to);
    std::vector<double> squared(from.size());
    SPLAT_TRY(parallel_for((from.size() + kBlock - 1) / kBlock, kMostHostThreads,
                           [&](std::size_t block) -> Status {
                               const std::size_t end = std::min(from.size(), (block + 1) * kBlock);
                               for (std::size_t i = block * kBlock; i < end; ++i)
                                   squared[i] = tree.squared_distance(from[i]);
                               return {};
                           }));
    Distances found;
    for (const double square : squared) {
        const double distance = std::sqrt(square);
        found.mean += distance;
        found.squared += square;
        if (distance < threshold) found.near += 1;
    }
    const auto n = static_cast<double>(from.size());
    return Distances{found.mean / n, found.squared / n, found.near / n};
}

}  // namespace

Result<PointScores> compare_points(std::span<const scene::Vec3> predicted,
                                   std::span<const scene::Vec3> truth, double threshold) {
    if (!(threshold > 0) || !std::isfinite(threshold))
        return invalid("the threshold is %g, expected a distance > 0", threshold);
    SPLAT_TRY(check_points(predicted, "predicted"));
    SPLAT_TRY(check_points(truth, "true"));
    SPLAT_ASSIGN(const Distances there, distances_of(predicted, truth, threshold));
    SPLAT_ASSIGN(const Distances back, distances_of(truth, predicted, threshold));
    PointScores scores;
    scores.accuracy = there.mean;
    scores.completeness = back.mean;
    scores.chamfer = (there.mean + back.mean) / 2;
    scores.chamfer_squared = there.squared + back.squared;
    scores.precision = there.near;
    scores.recall = back.near;
    const double sum = there.near + back.near;
    scores.f_score = sum > 0 ? 2 * there.near * back.near / sum : 0;
    return scores;
}

}  // namespace splat::prior_scores

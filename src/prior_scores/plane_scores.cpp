#include "prior_scores/plane_scores.h"

#include <algorithm>
#include <array>
#include <map>
#include <numbers>
#include <vector>

#include "prior_scores/check_map.h"
#include "scene/vector.h"

namespace splat::prior_scores {
namespace {

constexpr std::size_t kChannels = 4;
constexpr std::size_t kNone = SIZE_MAX;

/// The planes of a map.
struct Planes {
    using Numbers = std::array<float, kChannels>;
    std::vector<std::size_t> ids;  ///< plane of each pixel, or kNone
    std::vector<Numbers> planes;
    std::vector<std::uint64_t> pixels;

    [[nodiscard]] scene::Vec3 normal(std::size_t id) const {
        const Numbers& n = planes[id];
        return {static_cast<double>(n[0]), static_cast<double>(n[1]), static_cast<double>(n[2])};
    }
    [[nodiscard]] double distance(std::size_t id) const {
        return static_cast<double>(planes[id][3]);
    }
};

Result<Planes> planes_in(std::span<const float> map, const char* name) {
    Planes found;
    std::map<Planes::Numbers, std::size_t> known;
    for (std::size_t i = 0; i < map.size(); i += kChannels) {
        Planes::Numbers numbers{};
        std::copy_n(map.begin() + static_cast<std::ptrdiff_t>(i), kChannels, numbers.begin());
        found.ids.push_back(kNone);
        if (!(numbers[3] > 0)) continue;
        const auto [at, fresh] = known.emplace(numbers, found.planes.size());
        if (fresh) {
            found.planes.push_back(numbers);
            found.pixels.push_back(0);
            if (found.normal(at->second) == scene::Vec3{})
                return invalid("%s: pixel %zu has the distance %g of a plane, but no normal", name,
                               i / kChannels, static_cast<double>(numbers[3]));
        }
        found.ids.back() = at->second;
        ++found.pixels[at->second];
    }
    return found;
}

bool agree(const Planes& a, std::size_t i, const Planes& b, std::size_t j, double distance,
           double degrees) {
    const scene::Vec3 m = a.normal(i), n = b.normal(j);
    const double angle = std::atan2(glm::length(glm::cross(m, n)), glm::dot(m, n));
    return angle * 180 / std::numbers::pi <= degrees &&
           std::abs(a.distance(i) - b.distance(j)) <= distance;
}

}  // namespace

Result<PlaneScores> compare_planes(std::span<const float> prediction, std::span<const float> truth,
                                   double distance, double degrees) {
    if (truth.size() % kChannels != 0)
        return error(Code::kShape, "the true planes have %zu numbers, expected 4 for each pixel",
                     truth.size());
    SPLAT_TRY(check_map(truth, truth.size(), "the true planes"));
    SPLAT_TRY(check_map(prediction, truth.size(), "the predicted planes"));
    if (!(distance >= 0))
        return invalid("the most distance between planes is %g, expected at least 0", distance);
    if (!(degrees >= 0 && degrees <= 180))
        return invalid("the most angle between planes is %g degrees, expected 0 to 180", degrees);
    SPLAT_ASSIGN(const Planes p, planes_in(prediction, "the predicted planes"));
    SPLAT_ASSIGN(const Planes t, planes_in(truth, "the true planes"));
    if (t.planes.empty()) return invalid("the truth has no plane: its distances are nowhere > 0");

    std::map<std::array<std::size_t, 2>, std::uint64_t> common;  // by true and predicted plane
    for (std::size_t i = 0; i < t.ids.size(); ++i)
        if (t.ids[i] != kNone && p.ids[i] != kNone) ++common[{t.ids[i], p.ids[i]}];
    std::vector<double> best(t.planes.size(), 0);
    double found = 0;  // an IoU above 0.5 is that of one pair alone
    for (const auto& [pair, pixels] : common) {
        const auto [i, j] = pair;
        const auto both = static_cast<double>(pixels);
        const double iou = both / (static_cast<double>(t.pixels[i] + p.pixels[j]) - both);
        best[i] = std::max(best[i], iou);
        if (iou > 0.5 && agree(p, j, t, i, distance, degrees)) ++found;
    }
    PlaneScores scores;
    scores.predicted = p.planes.size();
    scores.truth = t.planes.size();
    for (std::size_t i = 0; i < best.size(); ++i) {
        scores.pixels += t.pixels[i];
        scores.covering += static_cast<double>(t.pixels[i]) * best[i];
    }
    scores.covering /= static_cast<double>(scores.pixels);
    scores.recall = found / static_cast<double>(scores.truth);
    if (scores.predicted > 0) scores.precision = found / static_cast<double>(scores.predicted);
    return scores;
}

}  // namespace splat::prior_scores

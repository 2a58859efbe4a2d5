#include "prior_models/point_depth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace splat::prior_models {
namespace {

constexpr std::uint32_t kSamples = 64;  ///< samples along each side

/// A point and the pixel that shows it.
struct Seen {
    double x, y, z, u, v;
};

/// Points of a grid, where the mask has them.
std::vector<Seen> seen_points(const Planes& points, const std::vector<bool>& valid) {
    const double w = points.size.width, h = points.size.height, half = std::hypot(w, h) / 2;
    std::vector<Seen> seen;
    const std::uint32_t rows = std::min(kSamples, points.size.height);
    const std::uint32_t columns = std::min(kSamples, points.size.width);
    for (std::uint32_t j = 0; j < rows; ++j)
        for (std::uint32_t i = 0; i < columns; ++i) {
            const std::size_t row = std::size_t{j} * points.size.height / rows;
            const std::size_t column = std::size_t{i} * points.size.width / columns;
            const std::size_t pixel = row * points.size.width + column;
            if (!valid[pixel]) continue;
            const float* const p = points.values.data() + 3 * pixel;
            seen.push_back({static_cast<double>(p[0]), static_cast<double>(p[1]),
                            static_cast<double>(p[2]),
                            (static_cast<double>(column) + 0.5 - w / 2) / half,
                            (static_cast<double>(row) + 0.5 - h / 2) / half});
        }
    return seen;
}

/// A shift with its focal length, best or known, and the squared error.
struct Fitted {
    double focal, error;
};

Fitted fitted(const std::vector<Seen>& seen, double shift, std::optional<double> known) {
    double product = 0, square = 0, target = 0;
    for (const Seen& p : seen) {
        const double x = p.x / (p.z + shift), y = p.y / (p.z + shift);
        product += x * p.u + y * p.v;
        square += x * x + y * y;
        target += p.u * p.u + p.v * p.v;
    }
    const double focal = known ? *known : square > 0 ? product / square : 0;
    return {focal, target + focal * (focal * square - 2 * product)};
}

/// The best shift: a search over distances of the nearest point, which are relative to the size of the cloud, then
/// golden sections.
double best_shift(const std::vector<Seen>& seen, std::optional<double> known) {
    double nearest = std::numeric_limits<double>::infinity(), size = 0;
    for (const Seen& p : seen) {
        nearest = std::min(nearest, p.z);
        size = std::max({size, std::abs(p.x), std::abs(p.y)});
    }
    if (size == 0) size = 1;
    constexpr int kSteps = 120;
    const auto shift_of = [&](double t) { return size * std::pow(10, t) - nearest; };
    const auto error_of = [&](double t) { return fitted(seen, shift_of(t), known).error; };
    const auto place = [](int i) { return -3 + 6.0 * i / kSteps; };
    int best = 0;
    for (int i = 1; i <= kSteps; ++i)
        if (error_of(place(i)) < error_of(place(best))) best = i;
    double low = place(best - 1), high = place(best + 1);
    constexpr double kGolden = 0.6180339887498949;
    for (int i = 0; i < 60; ++i) {
        const double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
        if (error_of(a) < error_of(b))
            high = b;
        else
            low = a;
    }
    return shift_of((low + high) / 2);
}

/// The focal length of kOtherwiseDegrees across the width.
double otherwise_focal(Extent size) {
    const double half_width = size.width / std::hypot(size.width, size.height);
    return half_width / std::tan(kOtherwiseDegrees * std::numbers::pi / 360);
}

void find_camera(const std::vector<Seen>& seen, Extent size, std::optional<double> known,
                 PointDepth& made) {
    if (seen.size() < 2) {
        if (known) made.focal = *known;
        return;
    }
    made.shift = best_shift(seen, known);
    made.focal = fitted(seen, made.shift, known).focal;
    if (made.focal > 0 && std::isfinite(made.focal)) return;
    made.found = false;
    made.focal = otherwise_focal(size);
    made.shift = best_shift(seen, made.focal);
}

}  // namespace

Result<PointDepth> point_depth(const Planes& points, const MapSource& source,
                               const std::string& name, std::optional<double> known) {
    const std::size_t area = std::size_t{points.size.width} * points.size.height;
    std::vector<bool> valid(area, true);
    if (source.mask != nullptr) {
        const std::string of_mask = "the mask of " + name;
        SPLAT_ASSIGN(const Planes mask,
                     planes_of(*source.mask, {false, 0, 1, source.picture}, of_mask));
        if (mask.size != points.size)
            return damaged("%s is %u x %u pixels, expected the points' %u x %u", of_mask.c_str(),
                           mask.size.width, mask.size.height, points.size.width,
                           points.size.height);
        for (std::size_t i = 0; i < area; ++i) valid[i] = mask.values[i] > 0.5F;
    }
    double scale = 1;
    if (source.scale != nullptr && source.picture < source.scale->values.size())
        scale = static_cast<double>(source.scale->values[source.picture]);
    if (std::ranges::find(valid, true) == valid.end())
        return bad_state("%s has no valid point: the model sees nothing in this picture",
                         name.c_str());
    PointDepth made;
    find_camera(seen_points(points, valid), points.size, known, made);
    made.depth = {points.size, 1, std::vector<float>(area)};
    double farthest = 0;
    for (std::size_t i = 0; i < area; ++i) {
        const double z = (static_cast<double>(points.values[3 * i + 2]) + made.shift) * scale;
        valid[i] = valid[i] && z > 0;
        if (!valid[i]) continue;
        made.depth.values[i] = static_cast<float>(z);
        farthest = std::max(farthest, z);
    }
    for (std::size_t i = 0; i < area; ++i)
        if (!valid[i]) made.depth.values[i] = static_cast<float>(farthest);
    return made;
}

}  // namespace splat::prior_models

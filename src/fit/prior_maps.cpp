#include "fit/prior_maps.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "core/rng.h"
#include "scene/camera_pose.h"

namespace splat::fit {
namespace {

constexpr std::size_t kLeastPoints = 16;
constexpr std::size_t kMostPoints = 2048;  ///< enough to align a map by
constexpr std::uint32_t kLines = 300;      ///< drawn through pairs of points
constexpr double kQuantile = 0.3;
constexpr int kTukeyTurns = 10;     ///< improvements by Tukey's weights
constexpr double kAgreement = 0.1;  ///< inverse depths agree within this share
constexpr double kFarthest = 0.02;  ///< least inverse depth of a point, in means of its map

bool counts_at(const data::PosedPhoto& photo, std::size_t i) {
    return photo.pixels[i] >> 24 == 255;
}

/// Where a photograph may show a place.
struct SeenPlace {
    std::size_t pixel = 0;
    double inverse_depth = 0;
};

std::optional<SeenPlace> seen_at(const data::PosedPhoto& photo, const scene::Vec3& place) {
    const scene::Camera& camera = photo.camera;
    const scene::Vec3 p = scene::rotation_of(camera.world_to_camera) * place +
                          scene::translation_of(camera.world_to_camera);
    if (!(p.z > 0)) return {};
    const double u = camera.fx * p.x / p.z + camera.cx, v = camera.fy * p.y / p.z + camera.cy;
    if (!(u >= 0 && v >= 0 && u < photo.width && v < photo.height)) return {};
    const std::size_t pixel =
        static_cast<std::size_t>(v) * photo.width + static_cast<std::size_t>(u);
    if (!counts_at(photo, pixel) || std::isnan(photo.nearness[pixel])) return {};
    return SeenPlace{pixel, 1 / p.z};
}

double inverse_depth(const PriorAlignment& alignment, float nearness) {
    return alignment.scale * static_cast<double>(nearness) + alignment.shift;
}

/// A point: what the map says, and its inverse depth.
struct Pair {
    double map = 0, inverse = 0;
};

/// The line through two of the pairs that most of the best fit. Errors that are left go to `error`.
PriorAlignment drawn_line(const std::vector<Pair>& pairs, double& error) {
    PriorAlignment best;
    error = std::numeric_limits<double>::infinity();
    std::vector<double> errors(pairs.size());
    const auto middle = errors.begin() +
                        static_cast<std::ptrdiff_t>(kQuantile * static_cast<double>(errors.size()));
    for (std::uint32_t line = 0; line < kLines; ++line) {
        const auto word = philox({line, 0, 3, 0}, {0, 0});
        const Pair& a = pairs[word[0] % pairs.size()];
        const Pair& b = pairs[word[1] % pairs.size()];
        const double scale = (a.inverse - b.inverse) / (a.map - b.map);
        if (!(scale > 0) || !std::isfinite(scale)) continue;
        const double shift = a.inverse - scale * a.map;
        for (std::size_t i = 0; i < pairs.size(); ++i)
            errors[i] = std::abs(scale * pairs[i].map + shift - pairs[i].inverse);
        std::nth_element(errors.begin(), middle, errors.end());
        if (*middle < error) {
            error = *middle;
            best = {scale, shift, 1};
        }
    }
    return best;
}

/// Weighted least squares with Tukey's weights.
void improve(const std::vector<Pair>& pairs, double width, PriorAlignment& line) {
    for (int turn = 0; turn < kTukeyTurns; ++turn) {
        double n = 0, p = 0, pp = 0, y = 0, py = 0;
        for (const Pair& pair : pairs) {
            const double r = (line.scale * pair.map + line.shift - pair.inverse) / width;
            if (!(std::abs(r) < 1)) continue;
            const double weight = (1 - r * r) * (1 - r * r);
            n += weight;
            p += weight * pair.map;
            pp += weight * pair.map * pair.map;
            y += weight * pair.inverse;
            py += weight * pair.map * pair.inverse;
        }
        const double below = n * pp - p * p;
        if (!(below > 1e-9 * n * n)) return;
        line.scale = (n * py - p * y) / below;
        line.shift = (y - line.scale * p) / n;
    }
}

}  // namespace

std::vector<std::uint32_t> packed_maps(const data::PosedPhoto& photo, PriorCounts& counts) {
    counts = {};
    std::vector<std::uint32_t> made;
    const bool has_depth = !photo.nearness.empty(), has_normals = !photo.normals.empty();
    if (!has_depth && !has_normals) return made;
    made.resize(2 * photo.pixels.size());
    for (std::size_t i = 0; i < photo.pixels.size(); ++i) {
        if (!counts_at(photo, i)) continue;
        const std::size_t x = i % photo.width, y = i / photo.width;
        std::uint32_t* const word = &made[2 * i];
        if (has_depth && !std::isnan(photo.nearness[i])) {
            word[0] = std::bit_cast<std::uint32_t>(photo.nearness[i]);
            word[1] |= kMapDepth;
            ++counts.depth;
        }
        const bool inner = x > 0 && y > 0 && x + 1 < photo.width && y + 1 < photo.height;
        if (has_normals && photo.normals[i] != 0 && inner && counts_at(photo, i - 1) &&
            counts_at(photo, i + 1) && counts_at(photo, i - photo.width) &&
            counts_at(photo, i + photo.width)) {
            word[1] |= (photo.normals[i] & 0xFFFFFF) | kMapNormal;
            ++counts.normal;
        }
    }
    return made;
}

std::optional<PriorAlignment> aligned_to_points(const data::PosedPhoto& photo,
                                                std::span<const scene::Vec3> points) {
    if (photo.nearness.empty()) return {};
    std::vector<Pair> all, pairs;
    for (const scene::Vec3& point : points)
        if (const auto seen = seen_at(photo, point))
            all.push_back({static_cast<double>(photo.nearness[seen->pixel]), seen->inverse_depth});
    const std::size_t step = all.size() / kMostPoints + 1;
    for (std::size_t i = 0; i < all.size(); i += step) pairs.push_back(all[i]);
    if (pairs.size() < kLeastPoints) return {};
    double error = 0, size = 0;
    PriorAlignment line = drawn_line(pairs, error);
    for (const Pair& pair : pairs) size += pair.inverse / static_cast<double>(pairs.size());
    if (!std::isfinite(error)) return {};
    // In a normal distribution 30 % of the errors are below 0.385 deviations; Tukey's width of
    // 4.685 lets in too many points that are hidden just behind what is seen.
    improve(pairs, std::max(2.5 * error / 0.385, 1e-6 * size), line);
    double sum = 0, count = 0;
    for (std::size_t i = 0; i < photo.pixels.size(); ++i) {
        if (!counts_at(photo, i) || std::isnan(photo.nearness[i])) continue;
        sum += std::max(inverse_depth(line, photo.nearness[i]), 0.0);
        count += 1;
    }
    if (!(line.scale > 0 && sum > 0)) return {};
    line.mean = sum / count;
    return line;
}

io::ColoredPoints dense_points(std::span<const data::PosedPhoto> photos,
                               std::span<const std::optional<PriorAlignment>> alignments,
                               std::size_t count) {
    double pixels = 0;
    for (std::size_t i = 0; i < photos.size(); ++i)
        if (alignments[i]) pixels += static_cast<double>(photos[i].pixels.size());
    const auto step = static_cast<std::uint32_t>(
        std::max(1.0, std::sqrt(pixels / static_cast<double>(std::max<std::size_t>(count, 1)))));
    /// Views that see the place there, less those that see through it.
    const auto votes = [&](std::size_t from, const scene::Vec3& place) {
        int sum = 0;
        for (std::size_t i = 0; i < photos.size(); ++i) {
            if (i == from || !alignments[i]) continue;
            const auto seen = seen_at(photos[i], place);
            if (!seen) continue;
            const double surface = inverse_depth(*alignments[i], photos[i].nearness[seen->pixel]);
            if (seen->inverse_depth > (1 + kAgreement) * surface)
                --sum;
            else if (seen->inverse_depth > (1 - kAgreement) * surface)
                ++sum;
        }
        return sum;
    };
    io::ColoredPoints made;
    for (std::size_t i = 0; i < photos.size(); ++i) {
        if (!alignments[i]) continue;
        const data::PosedPhoto& photo = photos[i];
        const scene::Camera& camera = photo.camera;
        const scene::Mat3 to_world = glm::transpose(scene::rotation_of(camera.world_to_camera));
        const scene::Vec3 center = scene::camera_center(camera);
        for (std::uint32_t y = step / 2; y < photo.height; y += step)
            for (std::uint32_t x = step / 2; x < photo.width; x += step) {
                const std::size_t pixel = std::size_t{y} * photo.width + x;
                if (!counts_at(photo, pixel) || std::isnan(photo.nearness[pixel])) continue;
                const double inverse = inverse_depth(*alignments[i], photo.nearness[pixel]);
                if (!(inverse > kFarthest * alignments[i]->mean)) continue;
                const scene::Vec3 ray((x + 0.5 - camera.cx) / camera.fx,
                                      (y + 0.5 - camera.cy) / camera.fy, 1);
                const scene::Vec3 place = center + to_world * ray / inverse;
                if (votes(i, place) < 0) continue;
                made.positions.push_back(place);
                const std::uint32_t color = photo.pixels[pixel];
                made.colors.push_back({static_cast<std::uint8_t>(color),
                                       static_cast<std::uint8_t>(color >> 8),
                                       static_cast<std::uint8_t>(color >> 16)});
            }
    }
    return made;
}

}  // namespace splat::fit

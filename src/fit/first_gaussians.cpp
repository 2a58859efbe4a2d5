#include "fit/first_gaussians.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/rng.h"
#include "scene/activate.h"
#include "scene/camera_pose.h"
#include "scene/nearest_points.h"
#include "scene/sh.h"

namespace splat::fit {
namespace {

constexpr double kFirstOpacity = 0.1;
constexpr double kLeastScale = 1e-7;  ///< for points in one place, in extents of all

/// Words of the stream `stream` of a seed.
std::array<std::uint32_t, 4> words(std::uint64_t seed, std::uint32_t stream, std::size_t i) {
    return philox({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(i >> 32), stream, 0},
                  {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)});
}

/// `most` of `count` numbers, by the seed, in ascending order.
std::vector<std::size_t> drawn(std::size_t count, std::size_t most, std::uint64_t seed) {
    std::vector<std::size_t> all(count);
    std::iota(all.begin(), all.end(), std::size_t{0});
    if (count <= most) return all;
    std::vector<std::uint64_t> keys(count);
    for (std::size_t i = 0; i < count; ++i) {
        const auto word = words(seed, 1, i);
        keys[i] = (std::uint64_t{word[0]} << 32) | word[1];
    }
    std::sort(all.begin(), all.end(), [&](std::size_t a, std::size_t b) {
        return keys[a] != keys[b] ? keys[a] < keys[b] : a < b;
    });
    all.resize(most);
    std::sort(all.begin(), all.end());
    return all;
}

double extent_of(std::span<const scene::Vec3> places) {
    scene::Vec3 low = places[0], high = places[0];
    for (const scene::Vec3& place : places) {
        low = glm::min(low, place);
        high = glm::max(high, place);
    }
    return glm::length(high - low);
}

}  // namespace

Result<scene::Gaussians> first_gaussians(const io::ColoredPoints& points, std::uint32_t most,
                                         std::uint64_t seed) {
    if (points.positions.size() < 2)
        return invalid("%zu points to begin with, expected at least 2", points.positions.size());
    scene::Gaussians made;
    std::vector<scene::Vec3> places;
    const auto chosen = drawn(points.positions.size(), most, seed);
    for (const std::size_t i : chosen) places.push_back(points.positions[i]);
    const scene::NearestPoints tree(places);
    const double least = std::max(kLeastScale * extent_of(points.positions), 1e-30);
    const auto logit = static_cast<float>(scene::logit_of(kFirstOpacity));
    for (std::size_t i = 0; i < places.size(); ++i) {
        std::array<double, 4> squared{};  // the first one is the point itself
        tree.squared_distances(places[i], squared);
        double sum = 0, count = 0;
        for (const double distance : std::span(squared).subspan(1)) {
            if (!std::isfinite(distance)) continue;
            sum += distance;
            count += 1;
        }
        const double scale = std::max(std::sqrt(sum / std::max(count, 1.0)), least);
        for (std::size_t k = 0; k < 3; ++k) {
            made.means.push_back(static_cast<float>(places[i][k]));
            made.log_scales.push_back(static_cast<float>(std::log(scale)));
            const double color = points.colors[chosen[i]][k] / 255.0;
            made.sh.push_back(static_cast<float>((color - 0.5) / scene::kSh0));
        }
        made.rotations.insert(made.rotations.end(), {1.0F, 0.0F, 0.0F, 0.0F});
        made.opacity_logits.push_back(logit);
    }
    return made;
}

io::ColoredPoints random_points(std::span<const scene::Camera> cameras, std::uint32_t count,
                                std::uint64_t seed) {
    // The place nearest to all axes: sum (1 - d d^T) (x - c) = 0, held near the mean of the centres by a small weight.
    scene::Mat3 sum(0);
    scene::Vec3 right(0), mean(0), ahead(0);
    std::vector<scene::Vec3> centers;
    for (const scene::Camera& camera : cameras) {
        const scene::Mat3 rotation = scene::rotation_of(camera.world_to_camera);
        const scene::Vec3 d =
            glm::normalize(scene::Vec3(rotation[0].z, rotation[1].z, rotation[2].z));
        const scene::Vec3 center = scene::camera_center(camera);
        const scene::Mat3 off = scene::Mat3(1) - glm::outerProduct(d, d);
        sum += off;
        right += off * center;
        mean += center / static_cast<double>(cameras.size());
        ahead += d / static_cast<double>(cameras.size());
        centers.push_back(center);
    }
    double spread = 0;
    for (const scene::Vec3& center : centers)
        spread += glm::length(center - mean) / static_cast<double>(centers.size());
    if (!(spread > 0)) spread = 1;
    const double hold = 1e-3 * static_cast<double>(cameras.size());
    const scene::Vec3 near = mean + spread * ahead;
    const scene::Vec3 target = glm::inverse(sum + hold * scene::Mat3(1)) * (right + hold * near);
    double side = 0;
    for (const scene::Vec3& center : centers)
        side += glm::length(center - target) / static_cast<double>(centers.size());
    io::ColoredPoints made;
    for (std::size_t i = 0; made.positions.size() < count && i < std::size_t{100} * count; ++i) {
        const auto word = words(seed, 2, i);
        scene::Vec3 place;
        for (std::size_t k = 0; k < 3; ++k)
            place[k] = target[k] + side * (word[k] / 4294967296.0 - 0.5);
        std::size_t seen = 0;
        for (const scene::Camera& camera : cameras) {
            const scene::Vec3 p = scene::rotation_of(camera.world_to_camera) * place +
                                  scene::translation_of(camera.world_to_camera);
            if (!(p.z > 0)) continue;
            const double u = camera.fx * p.x / p.z + camera.cx;
            const double v = camera.fy * p.y / p.z + camera.cy;
            seen += u >= 0 && v >= 0 && u < camera.width && v < camera.height ? 1 : 0;
        }
        if (seen >= std::min<std::size_t>(2, cameras.size())) made.positions.push_back(place);
    }
    made.colors.assign(made.positions.size(), {128, 128, 128});
    return made;
}

}  // namespace splat::fit

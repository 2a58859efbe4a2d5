#include "scene/orbit.h"

#include <algorithm>
#include <numbers>
#include <numeric>

#include "scene/activate.h"
#include "scene/select.h"

namespace splat::scene {
namespace {

/// The least value whose own weight and those of smaller ones are `part` of the sum of all.
double weighted_quantile(const std::vector<double>& values, const std::vector<double>& weights,
                         double part) {
    std::vector<std::size_t> order(values.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::sort(order, [&values](std::size_t a, std::size_t b) {
        return values[a] != values[b] ? values[a] < values[b] : a < b;
    });
    double left = part * std::accumulate(weights.begin(), weights.end(), 0.0);
    for (const std::size_t i : order)
        if ((left -= weights[i]) <= 0) return values[i];
    return values[order.back()];
}

/// A direction of length 1 at a right angle to `axis`: the part of +z, or of +x where that is short.
Vec3 across(const Vec3& axis) {
    for (const Vec3& candidate : {Vec3{0, 0, 1}, Vec3{1, 0, 0}}) {
        const Vec3 part = candidate - axis * glm::dot(candidate, axis);
        if (glm::length(part) > 0.1) return part * (1 / glm::length(part));
    }
    return {0, 1, 0};
}

/// The least distance from which a point is within kOrbitFill of the image in every view of the circle. At the height
/// h and the radius r about the axis, at the angle t from the camera, it lies d - (r cos t cos e + h sin e) in front
/// of a camera of elevation e, r sin t to its side and h cos e - r cos t sin e above its middle; x and y are the
/// largest tangents of the view.
double distance_for(const Vec3& point, const Vec3& up, double elevation, double x, double y) {
    const double h = glm::dot(point, up);
    const double r = glm::length(point - up * h);
    const double cosine = std::cos(elevation), sine = std::sin(elevation);
    double most = r * std::hypot(1 / x, cosine) + h * sine;  // the largest of all t
    for (const double side : {r, -r})                        // linear in r cos t, so at its ends
        most = std::max(most, std::abs(h * cosine - side * sine) / y + side * cosine + h * sine);
    return most;
}

Result<double> orbit_distance(const Body& body, const Vec3& up, const Camera& lens,
                              const OrbitOptions& options) {
    if (options.distance != 0) {
        if (options.distance > 0 && std::isfinite(options.distance)) return options.distance;
        return invalid("orbit: distance %g, expected > 0", options.distance);
    }
    double most = 0;
    for (const Vec3& mean : body.means)
        most = std::max(most, distance_for(mean - body.middle, up, options.elevation,
                                           kOrbitFill * lens.width / (2 * lens.fx),
                                           kOrbitFill * lens.height / (2 * lens.fy)));
    if (most > 0) return most;
    return invalid("orbit: the scene has no visible extent to derive a distance from; give one");
}

}  // namespace

Body body_of(const Gaussians& g) {
    Body body;
    std::vector<double> weights;
    body.means.reserve(g.count());
    weights.reserve(g.count());
    const auto take = [&](double least) {
        for (std::size_t i = 0; i < g.count(); ++i) {
            const double opacity = opacity_of(static_cast<double>(g.opacity_logits[i]));
            const Vec3 mean = glm::make_vec3(&g.means[3 * i]);
            if (!(opacity >= least) || !is_finite(mean)) continue;
            body.means.push_back(mean);
            weights.push_back(opacity);
        }
    };
    take(kLeastOpacity);
    if (body.means.empty()) take(0);
    if (body.means.empty()) return body;
    Vec3 median;
    std::vector<double> values(body.means.size());
    for (std::size_t k = 0; k < 3; ++k) {
        for (std::size_t i = 0; i < values.size(); ++i) values[i] = body.means[i][k];
        median[k] = weighted_quantile(values, weights, 0.5);
    }
    const auto far = [&median](const Vec3& mean) { return glm::length(mean - median); };
    std::ranges::transform(body.means, values.begin(), far);
    const double most = kBodyRadii * weighted_quantile(values, weights, 0.98);
    std::erase_if(body.means, [&](const Vec3& mean) { return far(mean) > most; });
    const Box bounds = bounds_of(body.means);
    body.middle = (bounds.low + bounds.high) * 0.5;
    return body;
}

Result<std::vector<Camera>> orbit(const Gaussians& gaussians, const OrbitOptions& options) {
    SPLAT_ASSIGN(const Camera lens, camera_from_fov(options.width, options.height, options.fov_x));
    const double size = glm::length(options.up);
    if (!(size > 0) || !std::isfinite(size) || !std::isfinite(options.elevation) ||
        !std::isfinite(options.start))
        return invalid("orbit: 'up' is zero, or an angle is not finite");
    const Vec3 up = options.up * (1 / size);
    const Body body = body_of(gaussians);
    SPLAT_ASSIGN(const double distance, orbit_distance(body, up, lens, options));
    const Vec3 front = -across(up);
    const Vec3 side = glm::cross(up, front);
    std::vector<Camera> cameras;
    for (std::uint32_t i = 0; i < options.count; ++i) {
        const double angle = options.start + 2 * std::numbers::pi * i / options.count;
        const double flat = distance * std::cos(options.elevation);
        const Vec3 eye = body.middle + (flat * (std::cos(angle) * front + std::sin(angle) * side) +
                                        distance * std::sin(options.elevation) * up);
        Camera camera = lens;
        camera.name = format("%03u", i);
        SPLAT_ASSIGN(camera.world_to_camera, look_at(eye, body.middle, up));
        cameras.push_back(std::move(camera));
    }
    return cameras;
}

}  // namespace splat::scene

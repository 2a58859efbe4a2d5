#include <algorithm>
#include <cmath>
#include <limits>

#include "core/status.h"
#include "data/posed_photos.h"

namespace splat::data {
namespace {

constexpr std::uint32_t kOpaque = 255U << 24;

/// A sum of colours in float32, 0 to 255.
struct Color {
    using Sample = std::uint32_t;
    float r = 0, g = 0, b = 0;

    static constexpr Sample kNone = 0;
    static bool is_there(Sample pixel) { return pixel != 0; }
    static bool are_there(Sample p, Sample q, Sample u, Sample v) {
        return (p & q & u & v) >= kOpaque;
    }
    void add(float weight, Sample pixel) {
        r += weight * static_cast<float>(pixel & 255U);
        g += weight * static_cast<float>(pixel >> 8 & 255U);
        b += weight * static_cast<float>(pixel >> 16 & 255U);
    }
    [[nodiscard]] Sample mean(float part) const {
        const auto rounded = [part](float sum) {
            return static_cast<std::uint32_t>(sum * part + 0.5F);
        };
        return rounded(r) | rounded(g) << 8 | rounded(b) << 16 | kOpaque;
    }
};

/// A sum of numbers; NaN is not there.
struct Number {
    using Sample = float;
    float sum = 0;

    static constexpr Sample kNone = std::numeric_limits<float>::quiet_NaN();
    static bool is_there(Sample number) { return !std::isnan(number); }
    static bool are_there(Sample p, Sample q, Sample u, Sample v) {
        return !std::isnan(p + q + u + v);
    }
    void add(float weight, Sample number) { sum += weight * number; }
    [[nodiscard]] Sample mean(float part) const { return sum * part; }
};

/// The photograph without its pixels at 1/factor of its size, and what is left out of it at the left and the top.
struct Reduced {
    PosedPhoto photo;
    std::uint32_t left = 0, top = 0;
};

Reduced reduced_camera(const PosedPhoto& photo, std::uint32_t factor) {
    SPLAT_ASSERT(factor >= 1 && factor <= std::min(photo.width, photo.height));
    Reduced to{
        {photo.name, photo.camera, photo.held_out, photo.width / factor, photo.height / factor, {}},
        photo.width % factor / 2,
        photo.height % factor / 2};
    scene::Camera& camera = to.photo.camera;
    camera.width = to.photo.width;
    camera.height = to.photo.height;
    camera.fx /= factor;
    camera.fy /= factor;
    camera.cx = (camera.cx - to.left) / factor;
    camera.cy = (camera.cy - to.top) / factor;
    return to;
}

/// Means of blocks. `add(x, y, sum)` adds the sample of a pixel, or returns false if it is not there.
template <class Sum, class Add>
std::vector<typename Sum::Sample> means(const Reduced& to, std::uint32_t factor, const Add& add) {
    std::vector<typename Sum::Sample> made;
    made.reserve(std::size_t{to.photo.width} * to.photo.height);
    const float part = 1 / static_cast<float>(factor * factor);
    const auto block = [&](std::uint32_t left, std::uint32_t top) {
        Sum sum;
        for (std::uint32_t y = top; y < top + factor; ++y)
            for (std::uint32_t x = left; x < left + factor; ++x)
                if (!add(x, y, sum)) return Sum::kNone;
        return sum.mean(part);
    };
    for (std::uint32_t y = 0; y < to.photo.height; ++y)
        for (std::uint32_t x = 0; x < to.photo.width; ++x)
            made.push_back(block(to.left + x * factor, to.top + y * factor));
    return made;
}

/// The photograph's planes, each by `plane(samples, sum of such samples)`.
template <class Plane>
PosedPhoto each_plane(const PosedPhoto& photo, Reduced to, const Plane& plane) {
    PosedPhoto& made = to.photo;
    made.pixels = plane(to, photo.pixels, Color());
    if (!photo.nearness.empty()) made.nearness = plane(to, photo.nearness, Number());
    if (!photo.normals.empty()) made.normals = plane(to, photo.normals, Color());
    return std::move(made);
}

}  // namespace

PosedPhoto undistort(const PosedPhoto& photo, const scene::Lens& lens, std::uint32_t factor) {
    const bool has_neighbours = photo.width > 1 && photo.height > 1;
    if (scene::is_pinhole(lens) || !has_neighbours) return reduce(photo, factor);
    const scene::Camera& camera = photo.camera;
    const double most_x = photo.width - 1, most_y = photo.height - 1;
    const double corner = std::hypot(std::max(camera.cx, photo.width - camera.cx) / camera.fx,
                                     std::max(camera.cy, photo.height - camera.cy) / camera.fy);
    const double radius = scene::unfolded_radius(lens, corner);
    const auto plane = [&](const Reduced& to, const auto& samples, auto zero) {
        using Sum = decltype(zero);
        return means<Sum>(to, factor, [&](std::uint32_t x, std::uint32_t y, Sum& sum) {
            const scene::Vec2 place{(x + 0.5 - camera.cx) / camera.fx,
                                    (y + 0.5 - camera.cy) / camera.fy};
            if (place.x * place.x + place.y * place.y > radius * radius) return false;
            const scene::Vec2 bent = scene::distort(lens, place);
            const double u = bent.x * camera.fx + camera.cx - 0.5;
            const double v = bent.y * camera.fy + camera.cy - 0.5;
            if (!(u >= 0 && v >= 0 && u <= most_x && v <= most_y)) return false;
            const auto column = std::min(static_cast<std::uint32_t>(u), photo.width - 2);
            const auto row = std::min(static_cast<std::uint32_t>(v), photo.height - 2);
            const auto* const top = &samples[std::size_t{row} * photo.width + column];
            const auto* const bottom = top + photo.width;
            if (!Sum::are_there(top[0], top[1], bottom[0], bottom[1])) return false;
            const auto a = static_cast<float>(u - column), b = static_cast<float>(v - row);
            sum.add((1 - a) * (1 - b), top[0]);
            sum.add(a * (1 - b), top[1]);
            sum.add((1 - a) * b, bottom[0]);
            sum.add(a * b, bottom[1]);
            return true;
        });
    };
    return each_plane(photo, reduced_camera(photo, factor), plane);
}

PosedPhoto reduce(const PosedPhoto& photo, std::uint32_t factor) {
    if (factor == 1) return photo;
    const auto plane = [&](const Reduced& to, const auto& samples, auto zero) {
        using Sum = decltype(zero);
        return means<Sum>(to, factor, [&](std::uint32_t x, std::uint32_t y, Sum& sum) {
            const auto sample = samples[std::size_t{y} * photo.width + x];
            sum.add(1, sample);
            return Sum::is_there(sample);
        });
    };
    return each_plane(photo, reduced_camera(photo, factor), plane);
}

}  // namespace splat::data

#include <algorithm>
#include <cmath>

#include "core/status.h"
#include "data/posed_photos.h"

namespace splat::data {
namespace {

constexpr std::uint32_t kOpaque = 255U << 24;

/// A colour in float32, 0 to 255.
struct Color {
    float r = 0, g = 0, b = 0;

    void add(float weight, std::uint32_t pixel) {
        r += weight * static_cast<float>(pixel & 255U);
        g += weight * static_cast<float>(pixel >> 8 & 255U);
        b += weight * static_cast<float>(pixel >> 16 & 255U);
    }
};

std::uint32_t rounded(float value) {
    return static_cast<std::uint32_t>(value + 0.5F);
}

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

/// Means of blocks. `add(x, y, sum)` adds the colour of a pixel, or returns false if it is not there.
template <class Add>
PosedPhoto means(const PosedPhoto& photo, std::uint32_t factor, const Add& add) {
    Reduced to = reduced_camera(photo, factor);
    to.photo.pixels.reserve(std::size_t{to.photo.width} * to.photo.height);
    const float part = 1 / static_cast<float>(factor * factor);
    const auto block = [&](std::uint32_t left, std::uint32_t top) {
        Color sum;
        for (std::uint32_t y = top; y < top + factor; ++y)
            for (std::uint32_t x = left; x < left + factor; ++x)
                if (!add(x, y, sum)) return 0U;
        return rounded(sum.r * part) | rounded(sum.g * part) << 8 | rounded(sum.b * part) << 16 |
               kOpaque;
    };
    for (std::uint32_t y = 0; y < to.photo.height; ++y)
        for (std::uint32_t x = 0; x < to.photo.width; ++x)
            to.photo.pixels.push_back(block(to.left + x * factor, to.top + y * factor));
    return std::move(to.photo);
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
    return means(photo, factor, [&](std::uint32_t x, std::uint32_t y, Color& sum) {
        const scene::Vec2 place{(x + 0.5 - camera.cx) / camera.fx,
                                (y + 0.5 - camera.cy) / camera.fy};
        if (place.x * place.x + place.y * place.y > radius * radius) return false;
        const scene::Vec2 bent = scene::distort(lens, place);
        const double u = bent.x * camera.fx + camera.cx - 0.5;
        const double v = bent.y * camera.fy + camera.cy - 0.5;
        if (!(u >= 0 && v >= 0 && u <= most_x && v <= most_y)) return false;
        const auto column = std::min(static_cast<std::uint32_t>(u), photo.width - 2);
        const auto row = std::min(static_cast<std::uint32_t>(v), photo.height - 2);
        const std::uint32_t* const top = &photo.pixels[std::size_t{row} * photo.width + column];
        const std::uint32_t* const bottom = top + photo.width;
        if ((top[0] & top[1] & bottom[0] & bottom[1]) < kOpaque) return false;
        const auto a = static_cast<float>(u - column), b = static_cast<float>(v - row);
        sum.add((1 - a) * (1 - b), top[0]);
        sum.add(a * (1 - b), top[1]);
        sum.add((1 - a) * b, bottom[0]);
        sum.add(a * b, bottom[1]);
        return true;
    });
}

PosedPhoto reduce(const PosedPhoto& photo, std::uint32_t factor) {
    if (factor == 1) return photo;
    return means(photo, factor, [&](std::uint32_t x, std::uint32_t y, Color& sum) {
        const std::uint32_t pixel = photo.pixels[std::size_t{y} * photo.width + x];
        sum.add(1, pixel);
        return pixel != 0;
    });
}

}  // namespace splat::data

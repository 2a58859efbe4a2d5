#include "triangles/view_table.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "scene/camera_pose.h"

namespace splat::triangles {
namespace {

using scene::Vec3;

/// A row of a map from the world to a number: direction . p + constant.
struct Row {
    Vec3 direction;
    double constant;

    [[nodiscard]] double of(const Vec3& p) const { return glm::dot(direction, p) + constant; }
};

/// The greatest magnitude over a box: at one of its corners, as the function is linear.
double most_over(const Row& row, const Vec3& low, const Vec3& high) {
    double most = 0;
    for (unsigned corner = 0; corner < 8; ++corner)
        most = std::max(most, std::abs(row.of({(corner & 1U) != 0 ? high.x : low.x,
                                               (corner & 2U) != 0 ? high.y : low.y,
                                               (corner & 4U) != 0 ? high.z : low.z})));
    return most;
}

/// Bits of corners in an image of which 16 (H + 8) subpixels lie on each side of the middle. Edge functions are sums of
/// three products of such a number and two differences of products of corners; they and a bit more fit 63 bits. float
/// has 24 exact ones.
int corner_bits(std::uint32_t half) {
    const double subpixels = std::log2(params::kSubpixels * (half + 8.0));
    return std::min(24, static_cast<int>(std::floor((62 - 1 - std::log2(3.0) - subpixels) / 2)));
}

/// The greatest power of two that brings `most` below 2^bits.
double scale_to(double most, int bits) {
    return most > 0 ? std::ldexp(1.0, bits - std::ilogb(most) - 1) : 1;
}

/// 45 degrees above the horizon, 30 degrees from the axis that is farthest from `up`.
Vec3 light_of(const Vec3& up) {
    Vec3 axis(0);
    std::size_t least = 0;
    for (std::size_t k = 1; k < 3; ++k)
        if (std::abs(up[k]) < std::abs(up[least])) least = k;
    axis[least] = 1;
    const Vec3 first = glm::normalize(axis - up * glm::dot(axis, up));
    const Vec3 second = glm::cross(up, first);
    const Vec3 horizon = first * std::sqrt(0.75) + second * 0.5;
    return (up + horizon) * std::sqrt(0.5);
}

}  // namespace

ViewTable view_table(const MeshOnDevice& mesh, const scene::Camera& camera,
                     const RenderDesc& desc) {
    const scene::Mat3 columns = scene::rotation_of(camera.world_to_camera);
    const Vec3 moved = scene::translation_of(camera.world_to_camera);
    const auto row = [&](std::size_t k) {
        return Row{{columns[0][k], columns[1][k], columns[2][k]}, moved[k]};
    };
    const auto mixed = [](const Row& a, double x, const Row& b, double y) {
        return Row{a.direction * x + b.direction * y, a.constant * x + b.constant * y};
    };
    const Row right = row(0), down = row(1), front = row(2);
    const double middle_x = camera.width / 2, middle_y = camera.height / 2;  // whole pixels
    const Row x = mixed(right, camera.fx, front, camera.cx - middle_x);
    const Row y = mixed(down, camera.fy, front, camera.cy - middle_y);
    const std::uint32_t half = std::bit_ceil(std::max(camera.width, camera.height) / 2 + 1);
    const double most =
        std::max({most_over(x, mesh.low, mesh.high), most_over(y, mesh.low, mesh.high),
                  half * most_over(front, mesh.low, mesh.high)});
    const double scale = scale_to(most, corner_bits(half));
    const double depth_scale = scale * half;

    ViewTable table;
    table.depth_unit = 1 / depth_scale;
    const auto set = [&](std::uint32_t quad, const Vec3& v, double w) {
        for (std::size_t k = 0; k < 3; ++k)
            table.quads[std::size_t{4} * quad + k] = static_cast<float>(v[k]);
        table.quads[std::size_t{4} * quad + 3] = static_cast<float>(w);
    };
    const auto set_row = [&](std::uint32_t quad, const Row& of, double by) {
        set(quad, of.direction * (mesh.unit * by), of.of(mesh.center()) * by);
    };
    set_row(params::kViewX, x, scale);
    set_row(params::kViewY, y, scale);
    set_row(params::kViewZ, front, depth_scale);
    const double near =
        desc.near_plane > 0 ? desc.near_plane : 1e-3 * glm::length(mesh.high - mesh.low);
    const double of_unit = 1 / (depth_scale * mesh.unit);
    const double samples = double{1} * desc.samples * desc.samples;
    set(params::kViewScale,
        {near * depth_scale, double{1} * params::kSubpixels * half,
         of_unit * of_unit / (camera.fx * camera.fy * samples)},
        0);
    const Vec3 up = glm::normalize(Vec3(desc.up[0], desc.up[1], desc.up[2]));
    set(params::kViewRight, right.direction, 1 / camera.fx);
    set(params::kViewDown, down.direction, 1 / camera.fy);
    set(params::kViewFront, front.direction, 0);
    set(params::kViewUp, up, camera.cx);
    set(params::kViewLight, light_of(up), camera.cy);
    return table;
}

}  // namespace splat::triangles

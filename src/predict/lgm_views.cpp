#include "predict/lgm_views.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "scene/camera_pose.h"

namespace splat::predict {
namespace {

constexpr std::array<double, 3> kMean = {0.485, 0.456, 0.406};
constexpr std::array<double, 3> kDeviation = {0.229, 0.224, 0.225};

}  // namespace

double camera_distance(const config::ModelConfig& network) {
    return (static_cast<double>(network.znear) + static_cast<double>(network.zfar)) / 2;
}

std::vector<scene::Mat4> poses_around(const config::ModelConfig& network, std::uint32_t count) {
    const double distance = camera_distance(network);
    std::vector<scene::Mat4> poses;
    for (std::uint32_t i = 0; i < count; ++i) {
        const double angle = 2 * std::numbers::pi * i / count;
        const scene::Vec3 eye = {distance * std::sin(angle), 0, -distance * std::cos(angle)};
        auto pose = scene::look_at(eye, {0, 0, 0}, scene::kUp);
        SPLAT_ASSERT(pose.ok());  // the distance is more than 0
        poses.push_back(pose.value());
    }
    return poses;
}

void move_origin(const config::ModelConfig& network, Views& views) {
    const auto distance = static_cast<float>(camera_distance(network));
    for (std::size_t view = 0; view + 16 <= views.view_to_world.size(); view += 16)
        views.view_to_world[view + 14] -= distance;
}

void append_lgm_planes(const config::ModelConfig& network, std::span<const float> image,
                       std::span<const float> view_to_world, std::vector<float>& inputs) {
    const std::size_t r = network.resolution, area = r * r;
    const std::size_t first = inputs.size();
    inputs.resize(first + 9 * area);
    float* const planes = inputs.data() + first;
    for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t p = 0; p < area; ++p)
            planes[c * area + p] = static_cast<float>(
                (static_cast<double>(image[c * area + p]) - kMean[c]) / kDeviation[c]);
    const auto row = [&](std::size_t i) {
        const auto at = [&](std::size_t k) {
            return static_cast<double>(view_to_world[4 * i + k]);
        };
        return scene::Vec3(at(0), -at(1), -at(2));  // right, up, back
    };
    const double half = static_cast<double>(r) / 2;
    const double focal =
        half / std::tan(static_cast<double>(network.fov_degrees) * std::numbers::pi / 360);
    const scene::Vec3 origin = row(3);
    for (std::size_t p = 0; p < area; ++p) {
        const double x = (static_cast<double>(p % r) + 0.5 - half) / focal;
        const double y = (static_cast<double>(p / r) + 0.5 - half) / focal;
        const scene::Vec3 d = glm::normalize(x * row(0) + y * row(1) + row(2));
        const scene::Vec3 moment = glm::cross(origin, d);
        for (int k = 0; k < 3; ++k) {
            planes[(3 + static_cast<std::size_t>(k)) * area + p] = static_cast<float>(moment[k]);
            planes[(6 + static_cast<std::size_t>(k)) * area + p] = static_cast<float>(d[k]);
        }
    }
}

}  // namespace splat::predict

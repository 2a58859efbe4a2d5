#include "raster/raster_scenes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "support/rng_fill.h"

namespace splat::test {
namespace {

constexpr double kDistance = 4;

float narrow(double value) {
    return static_cast<float>(value);
}

/// Rotation by the angle around the y axis and a little around the others, then a step back.
ref::RasterCamera<float> camera_at(const SceneSize& size, double angle, double distance) {
    ref::RasterCamera<float> camera;
    camera.width = size.width;
    camera.height = size.height;
    const auto larger = static_cast<double>(std::max(size.width, size.height));
    camera.fx = narrow(0.9 * larger);
    camera.fy = narrow(0.9 * larger);
    camera.cx = narrow(static_cast<double>(size.width) / 2);
    camera.cy = narrow(static_cast<double>(size.height) / 2);
    const ref::Mat3<double> rotation = ref::quaternion_matrix<double>(
        {std::cos(angle / 2) * std::cos(angle / 8), std::cos(angle / 2) * std::sin(angle / 8),
         std::sin(angle / 2), 0});
    for (std::size_t r = 0; r < 3; ++r)
        for (std::size_t c = 0; c < 3; ++c)
            camera.world_to_camera[4 * r + c] = narrow(rotation[r][c]);
    camera.world_to_camera[3] = narrow(0.1 * std::sin(3 * angle));
    camera.world_to_camera[11] = narrow(distance);
    return camera;
}

void add_unit_quaternion(std::vector<float>& rotations, Rng& rng) {
    double q[4];
    double squared = 0;
    for (double& element : q) {
        element = rng.normal();
        squared += element * element;
    }
    for (const double element : q) rotations.push_back(narrow(element / std::sqrt(squared)));
}

/// Means in a ball, scales around `scale`, opacities over all of (0, 1).
RasterCase ball(const SceneSize& size, std::uint64_t seed, double scale, std::size_t sh_degree) {
    Rng rng(seed);
    RasterCase scene;
    scene.camera = camera_at(size, 0.3, kDistance);
    scene.sh_coefficients = (sh_degree + 1) * (sh_degree + 1);
    for (float& channel : scene.background) channel = narrow(rng.uniform());
    for (std::size_t i = 0; i < size.count; ++i) {
        for (std::size_t k = 0; k < 3; ++k) {
            scene.means.push_back(narrow(0.7 * rng.normal()));
            scene.scales.push_back(narrow(scale * std::exp(0.6 * rng.normal())));
        }
        add_unit_quaternion(scene.rotations, rng);
        scene.opacities.push_back(narrow(0.05 + 0.94 * rng.uniform()));
        for (std::size_t k = 0; k < 3 * scene.sh_coefficients; ++k)
            scene.sh.push_back(narrow((k < 3 ? 0.8 : 0.4) * rng.normal()));
    }
    return scene;
}

/// Gaussian i of a scene, appended to another.
void append(RasterCase& to, const RasterCase& from, std::size_t i) {
    const auto copy = [i](std::vector<float>& target, const std::vector<float>& source,
                          std::size_t numbers) {
        const auto first = source.begin() + static_cast<std::ptrdiff_t>(i * numbers);
        target.insert(target.end(), first, first + static_cast<std::ptrdiff_t>(numbers));
    };
    copy(to.means, from.means, 3);
    copy(to.scales, from.scales, 3);
    copy(to.rotations, from.rotations, 4);
    copy(to.opacities, from.opacities, 1);
    copy(to.sh, from.sh, 3 * from.sh_coefficients);
}

/// Makes Gaussian i invalid in one of kSpoilings ways.
constexpr std::size_t kSpoilings = 16;

void spoil(RasterCase& scene, std::size_t i, std::size_t way) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float infinity = std::numeric_limits<float>::infinity();
    float* mean = &scene.means[3 * i];
    float* scale = &scene.scales[3 * i];
    float* rotation = &scene.rotations[4 * i];
    float* sh = &scene.sh[3 * i * scene.sh_coefficients];
    const ref::CameraFrame<double> frame(reference_scene<double>(scene, kRasterModes[0]).camera);
    const std::pair<float*, float> numbers[] = {{&mean[0], nan},
                                                {&mean[1], -infinity},
                                                {&mean[2], infinity},
                                                {&scale[1], nan},
                                                {&scale[0], infinity},
                                                {&rotation[2], nan},
                                                {&rotation[0], infinity},
                                                {nullptr, 0.0F},  // all of the rotation
                                                {nullptr, 1e-8F},
                                                {&scene.opacities[i], nan},
                                                {&scene.opacities[i], 0},
                                                {&scene.opacities[i], -1},
                                                {&sh[0], nan},
                                                {&sh[3 * scene.sh_coefficients - 1], infinity}};
    if (way >= std::size(numbers)) {  // at the camera, and behind it
        const double along = way == std::size(numbers) ? 0 : -1;
        for (std::size_t k = 0; k < 3; ++k)
            mean[k] = narrow(frame.centre[k] + along * frame.rotation[2][k]);
    } else if (const auto& [place, value] = numbers[way]; place != nullptr) {
        *place = value;
    } else {
        std::fill_n(rotation, 4, value);
    }
}

}  // namespace

RasterCase random_scene(const SceneSize& size, std::uint64_t seed, std::size_t sh_degree) {
    const double spacing =
        std::cbrt(1.0 / static_cast<double>(std::max<std::size_t>(size.count, 1)));
    RasterCase scene = ball(size, seed, 0.4 * spacing, sh_degree);
    scene.name = "random " + std::to_string(seed);
    return scene;
}

RasterCase needle_scene(const SceneSize& size, std::uint64_t seed, double length) {
    RasterCase scene = ball(size, seed, 1, 0);
    scene.name = "needles " + std::to_string(seed);
    Rng rng(seed + 1);
    for (std::size_t i = 0; i < size.count; ++i) {
        const std::size_t axis = rng.below(3);
        for (std::size_t k = 0; k < 3; ++k)
            scene.scales[3 * i + k] =
                narrow(k == axis ? length * (0.8 + 0.6 * rng.uniform())
                                 : 1e-4 * std::pow(10, 2 * rng.uniform() * rng.uniform()));
    }
    return scene;
}

RasterCase tie_scene(const SceneSize& size, std::uint64_t seed) {
    RasterCase scene = ball(size, seed, 0.25, 0);
    scene.name = "ties " + std::to_string(seed);
    scene.camera = camera_at(size, 0, kDistance);
    Rng rng(seed + 1);
    for (std::size_t i = 0; i < size.count; ++i)
        scene.means[3 * i + 2] = 0.25F * static_cast<float>(rng.below(4));
    return scene;
}

HostileScene hostile_scene(const SceneSize& size, std::uint64_t seed) {
    HostileScene scene{random_scene(size, seed, 1), {}, std::vector<bool>(size.count)};
    scene.without = scene.with;
    for (std::vector<float>* tensor :
         {&scene.without.means, &scene.without.scales, &scene.without.rotations,
          &scene.without.opacities, &scene.without.sh})
        tensor->clear();
    for (std::size_t i = 0; i < size.count; ++i) {
        scene.hostile[i] = i % 2 == 1;
        if (scene.hostile[i])
            spoil(scene.with, i, i / 2 % kSpoilings);
        else
            append(scene.without, scene.with, i);
    }
    scene.with.name = "hostile " + std::to_string(seed);
    return scene;
}

RasterCase splatter_scene(std::size_t side, std::size_t width, std::size_t height,
                          std::uint64_t seed) {
    const SceneSize size{side * side, width, height};
    RasterCase scene = ball(size, seed, 0.5 / static_cast<double>(side), 1);
    scene.name = "splatter " + std::to_string(side);
    scene.camera = camera_at(size, 0.8, 1.3);
    scene.background = {1, 1, 1};
    Rng rng(seed + 1);
    for (std::size_t i = 0; i < size.count; ++i) {
        const double half = static_cast<double>(side) / 2;
        const double x = (static_cast<double>(i % side) + 0.5) / half - 1;
        const double y = (static_cast<double>(i / side) + 0.5) / half - 1;
        const bool object = x * x + y * y < 0.4;
        const double z = object ? -0.5 * std::sqrt(0.4 - x * x - y * y) : 0.4;
        scene.means[3 * i] = narrow(0.5 * x + 0.01 * rng.normal());
        scene.means[3 * i + 1] = narrow(0.5 * y + 0.01 * rng.normal());
        scene.means[3 * i + 2] = narrow(z + 0.02 * rng.normal());
        const double logit = object ? 2 + 1.5 * rng.normal() : -6 + 1.5 * rng.normal();
        scene.opacities[i] = narrow(1 / (1 + std::exp(-logit)));
    }
    return scene;
}

RasterCase opaque_scene(const SceneSize& size, std::uint64_t seed) {
    RasterCase scene = ball(size, seed, 0.3, 0);
    scene.name = "opaque " + std::to_string(seed);
    Rng rng(seed + 1);
    for (float& opacity : scene.opacities) {
        const double drawn = 1 - 0.3 * rng.uniform() * rng.uniform();
        opacity = rng.below(4) == 0 ? 1.0F : narrow(drawn);
    }
    return scene;
}

RasterCase wide_scene(const SceneSize& size, std::uint64_t seed) {
    RasterCase scene = ball(size, seed, 0.4, 0);
    scene.name = "wide " + std::to_string(seed);
    scene.camera.fx *= 0.4F;
    scene.camera.fy *= 0.4F;
    scene.camera.world_to_camera[11] = 1.5F;
    for (float& element : scene.means) element *= 2;
    return scene;
}

RasterCase empty_scene(const SceneSize& size) {
    RasterCase scene = ball(size, 1, 0.1, 0);
    scene.name = "empty " + std::to_string(size.count);
    scene.camera.world_to_camera[11] = -100;
    return scene;
}

std::vector<float> loss_weights(const std::vector<bool>& fragile, std::size_t channels,
                                std::uint64_t seed) {
    std::vector<float> weights = normal_fill(fragile.size() * channels, seed);
    for (std::size_t i = 0; i < weights.size(); ++i)
        if (fragile[i / channels]) weights[i] = 0;
    return weights;
}

}  // namespace splat::test

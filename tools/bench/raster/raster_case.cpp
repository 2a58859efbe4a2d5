#include "bench/raster/raster_case.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <utility>

#include "vkrun/cli/options.h"
#include "vkrun/scene/camera_file.h"

namespace vkrun::bench {
namespace {

/// Centres uniform in the frustum, sizes log-normal around 1.5 pixels.
Scene random_scene(std::uint64_t count, double focal, double width, double height) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> depth(2, 10);
    std::uniform_real_distribution<double> side(-1.05, 1.05);
    std::normal_distribution<double> normal;
    std::vector<float> means, log_scales, rotations, logits, sh;
    const auto push = [](std::vector<float>& to, double x) { to.push_back(static_cast<float>(x)); };
    for (std::uint64_t i = 0; i < count; ++i) {
        const double z = depth(random);
        push(means, side(random) * width / 2 * z / focal);
        push(means, side(random) * height / 2 * z / focal);
        push(means, z);
        const double base = std::log(z / focal * 1.5) + 0.5 * normal(random);
        for (int k = 0; k < 3; ++k) push(log_scales, base + 0.5 * normal(random));
        double q[4];
        double squared = 0;
        for (double& x : q) {
            x = normal(random);
            squared += x * x;
        }
        for (const double x : q) push(rotations, x / std::sqrt(squared));
        push(logits, 1.5 * normal(random));
        for (int k = 0; k < 3; ++k) push(sh, 0.8 * normal(random));
    }
    auto desc = sized<splat_scene_desc>();
    desc.count = count;
    desc.means = means.data();
    desc.log_scales = log_scales.data();
    desc.rotations = rotations.data();
    desc.opacity_logits = logits.data();
    desc.sh = sh.data();
    Scene scene;
    check(splat_scene_create(&desc, scene.out()));
    return scene;
}

ImageSize size_of(const RasterCaseOptions& options) {
    return options.size.empty() ? ImageSize{640, 360} : image_size(options.size);
}

std::vector<splat_camera> cameras_for(const RasterCaseOptions& options, splat_scene scene) {
    std::vector<splat_camera> cameras;
    if (!options.cameras.empty()) {
        const CameraFile file =
            load_cameras(options.cameras, {image_size(options.size), options.ignore_distortion});
        for (const std::string& warning : file.warnings)
            std::fprintf(stderr, "vkrun: warning: %s\n", warning.c_str());
        cameras = file.cameras;
        if (cameras.empty()) throw Failure(kBadData, "'" + options.cameras + "' has no cameras");
    } else {
        const ImageSize size = size_of(options);
        auto desc = sized<splat_orbit_desc>();
        desc.width = size.width;
        desc.height = size.height;
        desc.distance = options.distance.value_or(0);
        cameras.resize(options.orbit > 0 ? options.orbit : 4);
        check(splat_camera_orbit(scene, &desc, static_cast<std::uint32_t>(cameras.size()),
                                 cameras.data()));
    }
    const double scale = options.scale.value_or(1);
    for (splat_camera& camera : cameras) {
        camera.width = static_cast<std::uint32_t>(std::lround(camera.width * scale));
        camera.height = static_cast<std::uint32_t>(std::lround(camera.height * scale));
        for (double* value : {&camera.fx, &camera.fy, &camera.cx, &camera.cy}) *value *= scale;
        if (camera.width != cameras[0].width || camera.height != cameras[0].height)
            throw Failure(kBadData, options.cameras + ": cameras of different sizes; expected one");
    }
    return cameras;
}

}  // namespace

void check_options(const RasterCaseOptions& options) {
    const std::pair<const char*, bool> of_a_scene[] = {{"--cameras", !options.cameras.empty()},
                                                       {"--orbit", options.orbit > 0},
                                                       {"--distance", options.distance.has_value()},
                                                       {"--scale", options.scale.has_value()}};
    for (const auto& [name, is_given] : of_a_scene)
        if (is_given && options.scene.empty())
            throw Failure(kUsageError, std::string(name) +
                                           " needs SCENE: the random scene has its own camera, "
                                           "whose size is --size");
    if (!options.cameras.empty() && (options.orbit > 0 || options.distance))
        throw Failure(kUsageError, std::string(options.orbit > 0 ? "--orbit" : "--distance") +
                                       " places cameras around the scene; those of --cameras have "
                                       "their places");
    if (options.ignore_distortion && options.cameras.empty())
        throw Failure(kUsageError, "--ignore-distortion is for --cameras");
    if (options.distance) check_number("--distance", *options.distance, 1e-6, 1e9);
    if (options.scale) check_number("--scale", *options.scale, 0.01, 16);
    check_background(options.background);
}

RasterCase make_case(const RasterCaseOptions& options) {
    RasterCase made;
    if (options.scene.empty()) {
        const auto [width, height] = size_of(options);
        const double focal = 0.78 * width;
        made.title = "random100k";
        made.scene = random_scene(100000, focal, width, height);
        made.cameras = {{width,
                         height,
                         focal,
                         focal,
                         width / 2.0,
                         height / 2.0,
                         {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}}};
    } else {
        made.title = options.scene.substr(options.scene.find_last_of('/') + 1);
        check(splat_scene_load(options.scene.c_str(), nullptr, made.scene.out()), kBadData);
        auto info = sized<splat_scene_info>();
        check(splat_scene_get_info(made.scene.get(), &info));
        if (info.count == 0)
            throw Failure(kBadData, "'" + options.scene + "' holds no Gaussians to be timed");
        made.cameras = cameras_for(options, made.scene.get());
    }
    made.convention =
        options.convention == "gsplat" ? SPLAT_CONVENTION_GSPLAT : SPLAT_CONVENTION_3DGS;
    std::copy_n(options.background.begin(), 3, made.background);
    return made;
}

}  // namespace vkrun::bench

#include <algorithm>
#include <filesystem>

#include "api/api_guard.h"
#include "api/handles.h"
#include "api/scene/camera_value.h"
#include "core/json_writer.h"
#include "io/colmap.h"
#include "io/file.h"
#include "io/transforms_json.h"
#include "scene/camera_pose.h"

using namespace splat;

namespace {

scene::Vec3 vec3(const double* values) {
    return {values[0], values[1], values[2]};
}

Result<scene::OrbitOptions> orbit_options(const splat_orbit_desc* desc) {
    scene::OrbitOptions options;
    options.elevation = 0;
    if (desc == nullptr) return options;
    SPLAT_TRY(api::check_desc(desc, "splat_orbit_desc", sizeof(splat_orbit_desc), 0));
    if (desc->width != 0) options.width = desc->width;
    if (desc->height != 0) options.height = desc->height;
    if (desc->fov_x != 0) options.fov_x = desc->fov_x;
    options.elevation = desc->elevation;
    options.start = desc->start;
    options.distance = desc->distance;
    const scene::Vec3 up = vec3(desc->up);
    if (up != scene::Vec3{}) options.up = up;
    return options;
}

Result<io::CameraSet> load(const char* path, const splat_camera_file_desc* desc) {
    splat_camera_file_desc full{};
    if (desc != nullptr) {
        SPLAT_TRY(api::check_desc(desc, "splat_camera_file_desc", sizeof full,
                                  SPLAT_CAMERA_IGNORE_DISTORTION));
        full = *desc;
    }
    io::CameraOptions options;
    options.ignore_distortion = (full.flags & SPLAT_CAMERA_IGNORE_DISTORTION) != 0;
    std::error_code unknown;
    if (std::filesystem::is_directory(path, unknown)) return io::load_colmap(path, options);
    SPLAT_ASSIGN(const io::Buffer file, io::read_file(path));
    auto set = io::read_transforms_json(file, full.width, full.height, options);
    if (!set.ok())
        return Status(set.status().code(),
                      "'" + std::string(path) + "': " + set.status().message());
    return set;
}

std::string report_of(const io::CameraSet& set) {
    JsonWriter json;
    json.begin_object().key("names").begin_array();
    for (const scene::Camera& camera : set.cameras) json.value(camera.name);
    json.end().key("warnings").list(set.warnings).end();
    return json.text();
}

}  // namespace

splat_result splat_camera_from_fov(uint32_t width, uint32_t height, double fov_x,
                                   splat_camera* camera) {
    return api::guarded([&]() -> Status {
        SPLAT_TRY(api::require(camera, "camera"));
        SPLAT_ASSIGN(const scene::Camera made, scene::camera_from_fov(width, height, fov_x));
        *camera = api::value_of(made);
        return {};
    });
}

splat_result splat_camera_look_at(splat_camera* camera, const double* eye, const double* target,
                                  const double* up) {
    return api::guarded([&]() -> Status {
        SPLAT_TRY(api::require(camera, "camera"));
        SPLAT_TRY(api::require(eye, "eye"));
        SPLAT_TRY(api::require(target, "target"));
        SPLAT_TRY(api::require(up, "up"));
        SPLAT_ASSIGN(const scene::Mat4 pose, scene::look_at(vec3(eye), vec3(target), vec3(up)));
        std::copy(pose.begin(), pose.end(), camera->world_to_camera);
        return {};
    });
}

splat_result splat_camera_from_opengl(splat_camera* camera, const double* camera_to_world) {
    return api::guarded([&]() -> Status {
        SPLAT_TRY(api::require(camera, "camera"));
        SPLAT_TRY(api::require(camera_to_world, "camera_to_world"));
        scene::Mat4 from;
        std::copy_n(camera_to_world, 16, from.begin());
        SPLAT_ASSIGN(const scene::Mat4 pose, scene::opencv_from_opengl(from));
        std::copy(pose.begin(), pose.end(), camera->world_to_camera);
        return {};
    });
}

splat_result splat_camera_to_opengl(const splat_camera* camera, double* camera_to_world) {
    return api::guarded([&]() -> Status {
        SPLAT_TRY(api::require(camera, "camera"));
        SPLAT_TRY(api::require(camera_to_world, "camera_to_world"));
        scene::Mat4 from;
        std::copy_n(camera->world_to_camera, 16, from.begin());
        SPLAT_ASSIGN(const scene::Mat4 pose, scene::opengl_from_opencv(from));
        std::copy(pose.begin(), pose.end(), camera_to_world);
        return {};
    });
}

splat_result splat_camera_orbit(splat_scene scene, const splat_orbit_desc* desc, uint32_t count,
                                splat_camera* cameras) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto object, api::Scenes::find(scene, "scene"));
        SPLAT_TRY(api::require(cameras, "cameras"));
        if (count == 0) return error(Code::kInvalidArgument, "count is 0, expected at least 1");
        SPLAT_ASSIGN(scene::OrbitOptions options, orbit_options(desc));
        options.count = count;
        scene::Statistics statistics;
        {
            const std::lock_guard lock(object->mutex);
            SPLAT_ASSIGN(statistics, scene::statistics(object->gaussians));
        }
        SPLAT_ASSIGN(const std::vector<scene::Camera> made, scene::orbit(statistics, options));
        std::transform(made.begin(), made.end(), cameras, api::value_of);
        return {};
    });
}

splat_result splat_camera_load(const char* path, const splat_camera_file_desc* desc,
                               splat_camera* cameras, uint32_t capacity, uint32_t* count) {
    splat_result given = SPLAT_OK;
    const splat_result result = api::guarded([&]() -> Status {
        SPLAT_TRY(api::require(path, "path"));
        if (capacity > 0) SPLAT_TRY(api::require(cameras, "cameras"));
        SPLAT_ASSIGN(const io::CameraSet set, load(path, desc));
        const std::size_t fitting = std::min<std::size_t>(capacity, set.cameras.size());
        for (std::size_t i = 0; i < fitting; ++i) cameras[i] = api::value_of(set.cameras[i]);
        if (count != nullptr) *count = static_cast<std::uint32_t>(set.cameras.size());
        if (fitting < set.cameras.size()) given = SPLAT_INCOMPLETE;
        return {};
    });
    return result != SPLAT_OK ? result : given;
}

splat_result splat_camera_load_report(const char* path, const splat_camera_file_desc* desc,
                                      char* buffer, size_t capacity, size_t* needed) {
    return api::guarded_text(buffer, capacity, needed, [&](auto give) -> Status {
        SPLAT_TRY(api::require(path, "path"));
        SPLAT_ASSIGN(const io::CameraSet set, load(path, desc));
        return give(report_of(set));
    });
}

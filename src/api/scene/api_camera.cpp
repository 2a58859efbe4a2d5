#include <algorithm>
#include <filesystem>

#include "api/api_guard.h"
#include "api/handles.h"
#include "api/scene/camera_value.h"
#include "core/json_writer.h"
#include "core/os/path.h"
#include "io/colmap.h"
#include "io/file.h"
#include "io/transforms_json.h"
#include "scene/camera_path.h"
#include "scene/orbit.h"

using namespace splat;

namespace {

scene::Vec3 vec3(const double* values) {
    return glm::make_vec3(values);
}

Result<scene::OrbitOptions> orbit_options(const splat_orbit_desc* desc) {
    scene::OrbitOptions options;
    options.elevation = 0;
    if (desc == nullptr) return options;
    SPLAT_TRY(api::check_desc(desc, 0));
    if (desc->width != 0) options.width = desc->width;
    if (desc->height != 0) options.height = desc->height;
    if (desc->fov_x != 0) options.fov_x = desc->fov_x;
    SPLAT_COPY(options, *desc, elevation, start, distance);
    const scene::Vec3 up = vec3(desc->up);
    if (up != scene::Vec3{}) options.up = up;
    return options;
}

/// How to read a file of cameras.
struct CameraReading {
    io::CameraOptions options;
    std::uint32_t width = 0, height = 0;  ///< where the file has none
};

Result<CameraReading> camera_reading(const splat_camera_file_desc* desc) {
    CameraReading reading;
    reading.options.may_ignore = true;
    if (desc == nullptr) return reading;
    SPLAT_TRY(api::check_desc(desc, SPLAT_CAMERA_IGNORE_DISTORTION));
    reading.options.ignore_distortion = (desc->flags & SPLAT_CAMERA_IGNORE_DISTORTION) != 0;
    reading.width = desc->width;
    reading.height = desc->height;
    return reading;
}

Result<io::CameraSet> load(const char* path, const splat_camera_file_desc* desc) {
    SPLAT_TRY(api::require(path, "path"));
    SPLAT_ASSIGN(const CameraReading reading, camera_reading(desc));
    std::error_code unknown;
    if (std::filesystem::is_directory(os::path_of(path), unknown))
        return io::load_colmap(path, reading.options);
    SPLAT_ASSIGN(const io::Buffer file, io::read_file(path));
    auto set = io::read_transforms_json(file, reading.width, reading.height, reading.options);
    if (!set.ok())
        return Status(set.status().code(),
                      "'" + std::string(path) + "': " + set.status().message());
    return set;
}

Result<io::CameraSet> load(const splat_camera_bytes* files, const splat_camera_file_desc* desc) {
    splat_camera_bytes given{};
    SPLAT_TRY(api::take_input(files, "files", given));
    SPLAT_TRY(api::require(given.cameras, "splat_camera_bytes.cameras"));
    SPLAT_ASSIGN(const CameraReading reading, camera_reading(desc));
    const auto bytes = [](const void* data, std::size_t size) {
        return io::Bytes(static_cast<const std::byte*>(data), size);
    };
    const io::Bytes cameras = bytes(given.cameras, given.camera_bytes);
    if (given.images == nullptr && given.image_bytes != 0)
        return invalid("splat_camera_bytes.images is NULL, but image_bytes is %zu",
                       given.image_bytes);
    if (given.images == nullptr)
        return io::read_transforms_json(cameras, reading.width, reading.height, reading.options);
    return io::read_colmap(cameras, bytes(given.images, given.image_bytes), reading.options);
}

/// Load cameras from a path or from memory, and copy as many as fit.
template <class From>
splat_result load_cameras(From from, const splat_camera_file_desc* desc, splat_camera* cameras,
                          std::uint32_t capacity, std::uint32_t* count) {
    splat_result given = SPLAT_OK;
    const splat_result result = api::guarded([&]() -> Status {
        if (capacity > 0) SPLAT_TRY(api::require(cameras, "cameras"));
        SPLAT_ASSIGN(const io::CameraSet set, load(from, desc));
        const std::size_t fitting = std::min<std::size_t>(capacity, set.cameras.size());
        for (std::size_t i = 0; i < fitting; ++i) cameras[i] = api::value_of(set.cameras[i]);
        if (count != nullptr) *count = static_cast<std::uint32_t>(set.cameras.size());
        if (fitting < set.cameras.size()) given = SPLAT_INCOMPLETE;
        return {};
    });
    return result != SPLAT_OK ? result : given;
}

Result<io::Buffer> camera_file(const splat_camera* cameras, const char* const* names,
                               std::uint32_t count) {
    if (count > 0) SPLAT_TRY(api::require(cameras, "cameras"));
    std::vector<scene::Camera> set;
    for (std::uint32_t i = 0; i < count; ++i) {
        if (names != nullptr) SPLAT_TRY(api::require(names[i], format("names[%u]", i).c_str()));
        set.push_back(api::camera_of(cameras[i], format("cameras[%u]", i)));
        SPLAT_TRY(scene::check_camera(set.back()));
        set.back().name = names != nullptr ? names[i] : "";
    }
    return io::write_transforms_json(set);
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
        SPLAT_TRY(api::require(camera, "camera", eye, "eye", target, "target", up, "up"));
        SPLAT_ASSIGN(const scene::Mat4 pose, scene::look_at(vec3(eye), vec3(target), vec3(up)));
        std::ranges::copy(pose, camera->world_to_camera);
        return {};
    });
}

splat_result splat_camera_from_opengl(splat_camera* camera, const double* camera_to_world) {
    return api::guarded([&]() -> Status {
        SPLAT_TRY(api::require(camera, "camera", camera_to_world, "camera_to_world"));
        scene::Mat4 from;
        std::copy_n(camera_to_world, 16, from.begin());
        SPLAT_ASSIGN(const scene::Mat4 pose, scene::opencv_from_opengl(from));
        std::ranges::copy(pose, camera->world_to_camera);
        return {};
    });
}

splat_result splat_camera_to_opengl(const splat_camera* camera, double* camera_to_world) {
    return api::guarded([&]() -> Status {
        SPLAT_TRY(api::require(camera, "camera", camera_to_world, "camera_to_world"));
        scene::Mat4 from;
        std::copy_n(camera->world_to_camera, 16, from.begin());
        SPLAT_ASSIGN(const scene::Mat4 pose, scene::opengl_from_opencv(from));
        std::ranges::copy(pose, camera_to_world);
        return {};
    });
}

splat_result splat_camera_orbit(splat_scene scene, const splat_orbit_desc* desc, uint32_t count,
                                splat_camera* cameras) {
    return api::with(scene, [&](const auto& object) -> Status {
        if (count > 0) SPLAT_TRY(api::require(cameras, "cameras"));
        SPLAT_ASSIGN(scene::OrbitOptions options, orbit_options(desc));
        if (count == 0) return {};
        options.count = count;
        const std::shared_lock lock(object->mutex);
        SPLAT_ASSIGN(const std::vector<scene::Camera> made,
                     scene::orbit(object->gaussians, options));
        std::ranges::transform(made, cameras, api::value_of);
        return {};
    });
}

splat_result splat_camera_path(const splat_camera* keys, uint32_t key_count, uint32_t closed,
                               uint32_t count, splat_camera* cameras) {
    return api::guarded([&]() -> Status {
        SPLAT_TRY(api::require(keys, "keys"));
        if (count > 0) SPLAT_TRY(api::require(cameras, "cameras"));
        if (closed > 1) return invalid("closed is %u, expected 0 or 1", closed);
        std::vector<scene::Camera> path;
        for (std::uint32_t i = 0; i < key_count; ++i) {
            path.push_back(api::camera_of(keys[i], format("keys[%u]", i)));
            SPLAT_TRY(scene::check_camera(path.back()));
        }
        SPLAT_SET(path, scene::camera_path(path, count, closed == 1));
        std::ranges::transform(path, cameras, api::value_of);
        return {};
    });
}

splat_result splat_camera_load(const char* path, const splat_camera_file_desc* desc,
                               splat_camera* cameras, uint32_t capacity, uint32_t* count) {
    return load_cameras(path, desc, cameras, capacity, count);
}

splat_result splat_camera_load_memory(const splat_camera_bytes* files,
                                      const splat_camera_file_desc* desc, splat_camera* cameras,
                                      uint32_t capacity, uint32_t* count) {
    return load_cameras(files, desc, cameras, capacity, count);
}

splat_result splat_camera_load_report(const char* path, const splat_camera_file_desc* desc,
                                      char* buffer, size_t capacity, size_t* needed) {
    return api::guarded_text(buffer, capacity, needed, [&]() -> Result<std::string> {
        SPLAT_ASSIGN(const io::CameraSet set, load(path, desc));
        return report_of(set);
    });
}

splat_result splat_camera_load_memory_report(const splat_camera_bytes* files,
                                             const splat_camera_file_desc* desc, char* buffer,
                                             size_t capacity, size_t* needed) {
    return api::guarded_text(buffer, capacity, needed, [&]() -> Result<std::string> {
        SPLAT_ASSIGN(const io::CameraSet set, load(files, desc));
        return report_of(set);
    });
}

splat_result splat_camera_save(const char* path, const splat_camera* cameras,
                               const char* const* names, uint32_t count) {
    return api::guarded([&]() -> Status {
        SPLAT_TRY(api::require(path, "path"));
        SPLAT_ASSIGN(const io::Buffer file, camera_file(cameras, names, count));
        return io::write_file(path, file);
    });
}

splat_result splat_camera_save_memory(const splat_camera* cameras, const char* const* names,
                                      uint32_t count, void* buffer, size_t capacity,
                                      size_t* needed) {
    return api::guarded_bytes(buffer, capacity, needed, [&](auto give) -> Status {
        SPLAT_ASSIGN(const io::Buffer file, camera_file(cameras, names, count));
        return give(file);
    });
}

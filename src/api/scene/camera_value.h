#pragma once

#include <algorithm>

#include "scene/camera.h"
#include "splat.h"

namespace splat::api {

/// Conversion between splat_camera and scene::Camera. Messages use `name`.
inline scene::Camera camera_of(const splat_camera& from, std::string name) {
    scene::Camera camera{std::move(name), from.width, from.height, from.fx,
                         from.fy,         from.cx,    from.cy,     {}};
    std::copy_n(from.world_to_camera, 16, camera.world_to_camera.begin());
    return camera;
}

inline splat_camera value_of(const scene::Camera& from) {
    splat_camera camera{from.width, from.height, from.fx, from.fy, from.cx, from.cy, {}};
    std::copy_n(from.world_to_camera.begin(), 16, camera.world_to_camera);
    return camera;
}

}  // namespace splat::api

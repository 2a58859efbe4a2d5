#pragma once

#include <cstdint>
#include <vector>

#include "scene/camera_pose.h"
#include "scene/vector.h"

namespace splat::test {

/// A room of 4 x 3 x 6 m with a table of 0.9 x 1 x 1 m in it, seen from inside: all of it planes whose truth is known.
struct Room {
    scene::Camera camera;
    std::vector<float> depth;    ///< [height, width]
    std::vector<float> normals;  ///< [height, width, 3]
    std::vector<float> planes;   ///< [height, width, 4]: normal and distance from the camera
};

/// The camera turns by `yaw` and `pitch`, radians; `fov` across the width.
inline Room room(std::uint32_t width, std::uint32_t height, double fov, double yaw, double pitch) {
    using scene::Vec3;
    struct Box {
        Vec3 low, high;
        bool inside;  ///< seen from inside
    };
    constexpr double kFar = 1e9;
    const Box boxes[] = {{{-2, -1.5, -1}, {2, 1.5, 5}, true},
                         {{0.3, 0.5, 2.5}, {1.2, 1.5, 3.5}, false}};
    Room made{scene::camera_from_fov(width, height, fov).value(), {}, {}, {}};
    const scene::Mat3 turn =
        glm::mat3_cast(glm::angleAxis(yaw, Vec3(0, 1, 0)) * glm::angleAxis(pitch, Vec3(1, 0, 0)));
    for (std::uint32_t y = 0; y < height; ++y)
        for (std::uint32_t x = 0; x < width; ++x) {
            const Vec3 ray = turn * Vec3((x + 0.5 - made.camera.cx) / made.camera.fx,
                                         (y + 0.5 - made.camera.cy) / made.camera.fy, 1);
            double z = kFar;
            Vec3 normal{};
            for (const Box& box : boxes)
                for (std::size_t k = 0; k < 3; ++k)
                    for (const bool high : {false, true}) {
                        const double at = (high ? box.high : box.low)[k] / ray[k];
                        const Vec3 hit = at * ray;
                        bool on = at > 1e-9 && at < z && high == (box.inside == (ray[k] > 0));
                        for (std::size_t j = 0; j < 3; ++j)
                            on = on && (j == k || (hit[j] >= box.low[j] && hit[j] <= box.high[j]));
                        if (!on) continue;
                        z = at;
                        normal = {};
                        normal[k] = ray[k] > 0 ? -1 : 1;
                    }
            const double distance = -z * glm::dot(normal, ray);
            const Vec3 seen = glm::transpose(turn) * normal;
            made.depth.push_back(static_cast<float>(z));
            for (std::size_t k = 0; k < 3; ++k) {
                made.normals.push_back(static_cast<float>(seen[k]));
                made.planes.push_back(static_cast<float>(seen[k]));
            }
            made.planes.push_back(static_cast<float>(std::round(distance * 1e6) / 1e6));
        }
    return made;
}

}  // namespace splat::test

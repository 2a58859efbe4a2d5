#pragma once

#include <string>

#include "core/fork.h"
#include "scene/triangle_mesh.h"

namespace splat::api {

/// The object behind splat_mesh.
struct MeshObject {
    ForkMutex mutex;
    scene::TriangleMesh mesh;
    std::string report;  ///< JSON; never changes
};

}  // namespace splat::api

#pragma once

#include <array>

#include "params/triangles/triangle_params.h"
#include "triangles/renderer.h"

namespace splat::triangles {

/// What the kernels read of a view.
struct ViewTable {
    std::array<float, std::size_t{4} * params::kViewQuads> quads{};
    double depth_unit = 1;  ///< unit of depths of samples, in that of the mesh
};

/// Corners become whole numbers of as many bits as the edge functions of an image of this size leave within 64 bits.
ViewTable view_table(const MeshOnDevice& mesh, const scene::Camera& camera, const RenderDesc& desc);

}  // namespace splat::triangles

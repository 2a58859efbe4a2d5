#pragma once

#include <array>
#include <span>
#include <vector>

#include "raster/raster_desc.h"
#include "scene/camera.h"

namespace splat::raster {

/// vec4 per view of the packed cameras: rows of [R|t]; fx fy cx cy; least and greatest x/z and y/z
/// of the Jacobian; position.
inline constexpr std::uint32_t kCameraQuads = 6;

/// Cameras and background as the kernels read them: [V,kCameraQuads] quads, one quad.
struct PackedViews {
    std::vector<float> values;

    [[nodiscard]] std::uint32_t count() const {
        return static_cast<std::uint32_t>((values.size() - 4) / (std::size_t{4} * kCameraQuads));
    }
};

/// Pack the cameras of one call. Errors: kInvalidArgument if there are more than desc.views, or if
/// a camera is singular, not finite, or of another size than desc.
Result<PackedViews> pack_views(const RasterDesc& desc, std::span<const scene::Camera> cameras,
                               const std::array<float, 3>& background);

}  // namespace splat::raster

#pragma once

#include <array>
#include <span>

#include "io/image.h"
#include "mesh_views/views_desc.h"

namespace splat::mesh_views {

/// How a view looks besides its object.
struct Look {
    std::array<float, 3> from{}, to{};  ///< sRGB at the ends of a gradient; equal for one colour
    double across = 0, down = 0;        ///< the gradient's direction, of length 1
    double gain = 1;                    ///< the object's light is multiplied by it

    /// The colour behind the middle of a pixel.
    [[nodiscard]] std::array<float, 3> at(std::uint32_t x, std::uint32_t y,
                                          std::uint32_t size) const;
};

Look look_of(const ViewsDesc& desc, std::uint32_t view);

/// An object over its background, mixed in linear light.
///
/// color   [size,size,3] sRGB, over black
/// alpha   [size,size] share of each pixel that the object covers
io::Image over_background(std::span<const float> color, std::span<const float> alpha,
                          std::uint32_t size, const Look& look);

}  // namespace splat::mesh_views

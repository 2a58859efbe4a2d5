#pragma once

#include <span>

#include "raster/rasterizer.h"
#include "scene/gaussians.h"
#include "vk/context.h"

namespace splat::raster {

/// A scene, or a gradient by one, in the packed layout of SceneViews.
struct PackedArrays {
    vk::Buffer gaussians;
    vk::Buffer colors;

    [[nodiscard]] SceneInput input(std::uint64_t version = 0) const {
        return {gaussians.range(), colors.range(), version};
    }
};

/// Memory for desc.gaussians Gaussians, zeros. Errors: those of Memory::allocate.
Result<PackedArrays> allocate_packed(vk::Context& context, const RasterDesc& desc);

/// Activate a scene of host memory and copy it to `to`: degrees above desc.sh_degree are left out,
/// those that the scene lacks are zeros. In pieces, so that little host memory is needed beside it.
///
/// Errors       those of Context::write; the scene has desc.gaussians Gaussians
/// Precision    as scene::activate()
Status upload_scene(vk::Context& context, const RasterDesc& desc, const scene::Gaussians& scene,
                    const PackedArrays& to);

/// The attributes as arrays of their own, row-major float32. A view without a buffer is absent.
struct AttributeViews {
    vk::BufferView means;      ///< [N,3]
    vk::BufferView scales;     ///< [N,3]
    vk::BufferView rotations;  ///< [N,4]
    vk::BufferView opacities;  ///< [N]
    vk::BufferView colors;     ///< [N,(degree+1)^2,3], or [N,3] for direct colours
};

/// Attributes into the packed layout, and gradients out of it, added where `accumulate`. Absent
/// attributes are passed over. Errors: the recorder's.
Status pack_attributes(vk::Recorder& recorder, const RasterDesc& desc, const AttributeViews& from,
                       const SceneInput& to);
Status unpack_attributes(vk::Recorder& recorder, const RasterDesc& desc, const SceneInput& from,
                         const AttributeViews& to, bool accumulate);

/// conics [items,3] (a, b, c of exp(-(a x^2 + c y^2)/2 - b x y), 0 for what is culled) from the
/// splats [items,3] quads and radii [items,2] that the projection left.
std::vector<float> conics_of(std::span<const float> splats, std::span<const float> radii);

}  // namespace splat::raster

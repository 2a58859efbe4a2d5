#pragma once

#include <array>
#include <span>
#include <vector>

#include "raster/raster_desc.h"
#include "scene/camera.h"
#include "scene/gaussians.h"
#include "vk/context.h"

namespace splat::raster {

/// Attributes of Gaussians, or their gradients, in one row-major float32 array each. A view
/// without a buffer is absent.
struct GaussianAttributes {
    vk::BufferView means;      ///< [N,3]
    vk::BufferView scales;     ///< [N,3]
    vk::BufferView rotations;  ///< [N,4]
    vk::BufferView opacities;  ///< [N]
    vk::BufferView colors;     ///< [N,(degree+1)^2,3], or [N,3] for direct colours
};

/// An activated scene in the layout that the kernels read.
struct PackedGaussians {
    vk::BufferView gaussians;   ///< [N,3] quads: mean xyz, opacity; scale xyz, 0; rotation wxyz
    vk::BufferView colors;      ///< [N,color_quads] quads
    std::uint32_t count = 0;    ///< N; the views may be longer
    std::uint64_t version = 0;  ///< changes with the contents; 0: not known
    /// Bands above this degree hold zeros, so the kernels skip them.
    std::uint32_t sh_degree = scene::kMaxShDegree;
};

/// Gradients of a scene, in the layout of PackedGaussians.
struct PackedGradients {
    vk::BufferView gaussians;
    vk::BufferView colors;
};

/// Device memory of a packed scene or of its gradients.
struct PackedBuffers {
    vk::Buffer gaussians;
    vk::Buffer colors;
    std::uint32_t count = 0;  ///< Gaussians

    [[nodiscard]] std::uint64_t bytes() const { return gaussians.bytes() + colors.bytes(); }
    [[nodiscard]] PackedGaussians scene(std::uint64_t version = 0,
                                        std::uint32_t sh_degree = scene::kMaxShDegree) const {
        return {gaussians.range(), colors.range(), count, version, sh_degree};
    }
    [[nodiscard]] PackedGradients gradients() const { return {gaussians.range(), colors.range()}; }
};

/// Memory for desc.gaussians Gaussians, filled with zeros. Errors: those of Memory::allocate.
Result<PackedBuffers> allocate_packed(vk::Context& context, const RasterDesc& desc);

/// Activate a scene in host memory and copy it to `to`. Bands above desc.sh_degree are left out,
/// bands that the scene lacks become zeros. Works in pieces to bound the host memory.
///
/// Errors       those of Context::write; the scene has desc.gaussians Gaussians
/// Precision    activated in float64, rounded once
Status upload_scene(vk::Context& context, const RasterDesc& desc, const scene::Gaussians& scene,
                    const PackedBuffers& to);

/// Copy the attributes that are present to their places in `to`. Errors: the recorder's.
Status pack_attributes(vk::Recorder& recorder, const RasterDesc& desc,
                       const GaussianAttributes& from, const PackedGaussians& to);

/// Copy packed gradients to the arrays that are present, or add them if `accumulate`. Errors: the
/// recorder's.
Status unpack_gradients(vk::Recorder& recorder, const RasterDesc& desc, const PackedGradients& from,
                        const GaussianAttributes& to, bool accumulate);

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

/// Conics [items,3] from the splats [items,3] quads and the radii [items,2] of the projection: a,
/// b, c of exp(-(a x^2 + c y^2)/2 - b x y), or zeros where the item is culled.
std::vector<float> conics_of(std::span<const float> splats, std::span<const float> radii);

}  // namespace splat::raster

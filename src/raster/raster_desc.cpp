#include "raster/raster_desc.h"

#include <algorithm>

#include "params/project_params.h"

namespace splat::raster {

std::uint32_t RasterDesc::flags() const {
    std::uint32_t flags = 0;
    if (convention != Convention::k3dgs) flags |= params::kFlagGsplat;
    if (rays()) flags |= params::kFlagRayMaximum;
    if (antialiased) flags |= params::kFlagAntialias;
    if (direct_colors) flags |= params::kFlagDirectColors;
    if (original_gradient) flags |= params::kFlagOriginalGradient;
    if (skips.opacity_extent) flags |= params::kFlagOpacityExtent;
    if (skips.exact_tiles) flags |= params::kFlagExactTiles;
    if (skips.cull) flags |= params::kFlagCull;
    if (view_sizes) flags |= params::kFlagViewSizes;
    if (tile_mask) flags |= params::kFlagTileMask;
    if (ranges.used) flags |= params::kFlagRanges;
    if (sort_by_distance) flags |= params::kFlagSortByDistance;
    if (cut_3_sigma) flags |= params::kFlagCut3Sigma;
    return flags;
}

std::uint32_t slice_size(const vk::DeviceInfo& device, vk::Kernels kernels,
                         const RasterDesc& desc) {
    // Multiples of 256 Gaussians keep slices aligned and workgroups full.
    const std::uint64_t stride = std::max<std::uint64_t>(3, desc.color_quads()) * 16;
    std::uint64_t most = device.limits.max_storage_buffer_bytes;
    if (kernels == vk::Kernels::kCpu) most = std::min(most, device.limits.max_texel_elements * 16);
    return static_cast<std::uint32_t>(
        std::clamp<std::uint64_t>(most / stride / 256 * 256, 256, std::uint64_t{1} << 30));
}

}  // namespace splat::raster

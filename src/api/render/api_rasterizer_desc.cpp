// The description of a rasterizer: what its fields mean.
#include "api/render/raster_calls.h"

using namespace splat;

namespace {

/// Flags of a rasterizer that computes gradients.
constexpr std::uint32_t kGradients =
    SPLAT_RASTERIZER_BACKWARD | SPLAT_RASTERIZER_GRAD_DEPTH | SPLAT_RASTERIZER_GRAD_POSE |
    SPLAT_RASTERIZER_GRAD_MEANS2D | SPLAT_RASTERIZER_GRAD_INTRINSICS |
    SPLAT_RASTERIZER_CONTRIBUTIONS | SPLAT_RASTERIZER_ORIGINAL_GRADIENT;

Status check_raster_flags(const splat_rasterizer_desc& desc) {
    const auto is_set = [&](std::uint32_t bit) { return (desc.flags & bit) != 0; };
    if (desc.convention < 0 || desc.convention > SPLAT_CONVENTION_RAY_MAXIMUM)
        return invalid("splat_rasterizer_desc.convention is %d, expected 0 to %d", desc.convention,
                       SPLAT_CONVENTION_RAY_MAXIMUM);
    if (desc.convention == SPLAT_CONVENTION_RAY_MAXIMUM) {
        if ((desc.flags & kGradients) != 0)
            return invalid(
                "splat_rasterizer_desc.flags: SPLAT_CONVENTION_RAY_MAXIMUM draws without "
                "gradients; train and fit "
                "with SPLAT_CONVENTION_3DGS or SPLAT_CONVENTION_GSPLAT");
        if (is_set(SPLAT_RASTERIZER_ANTIALIASED))
            return invalid(
                "splat_rasterizer_desc.flags: SPLAT_RASTERIZER_ANTIALIASED compensates for a "
                "dilation, which "
                "SPLAT_CONVENTION_RAY_MAXIMUM does not have");
    }
    const bool gsplat = desc.convention == SPLAT_CONVENTION_GSPLAT;
    for (const auto& [bit, name] : {std::pair(SPLAT_RASTERIZER_GRAD_POSE, "POSE"),
                                    std::pair(SPLAT_RASTERIZER_GRAD_INTRINSICS, "INTRINSICS")})
        if (is_set(bit) && !gsplat)
            return invalid(
                "splat_rasterizer_desc.flags: SPLAT_RASTERIZER_GRAD_%s needs "
                "SPLAT_CONVENTION_GSPLAT",
                name);
    if (is_set(SPLAT_RASTERIZER_ORIGINAL_GRADIENT) && gsplat)
        return invalid(
            "splat_rasterizer_desc.flags: SPLAT_RASTERIZER_ORIGINAL_GRADIENT needs "
            "SPLAT_CONVENTION_3DGS");
    if (is_set(SPLAT_RASTERIZER_DIRECT_COLORS) && desc.sh_degree != 0)
        return invalid(
            "splat_rasterizer_desc.sh_degree is %u, expected 0 with SPLAT_RASTERIZER_DIRECT_COLORS",
            desc.sh_degree);
    constexpr std::uint32_t kSkips = 2 * SPLAT_SKIP_BLOCKS - 1;
    if ((desc.disabled_skips & ~kSkips) != 0)
        return invalid("splat_rasterizer_desc.disabled_skips has unknown bits %#x",
                       desc.disabled_skips & ~kSkips);
    return {};
}

}  // namespace

Result<raster::RasterDesc> api::raster_desc_of(const splat_rasterizer_desc& from) {
    SPLAT_TRY(check_raster_flags(from));
    const auto is_set = [&](std::uint32_t bit) { return (from.flags & bit) != 0; };
    const auto skips = [&](std::uint32_t bit) { return (from.disabled_skips & bit) == 0; };
    raster::RasterDesc desc;
    SPLAT_COPY(desc, from, gaussians, width, height, sh_degree);
    desc.views = from.views == 0 ? 1 : from.views;
    desc.direct_colors = is_set(SPLAT_RASTERIZER_DIRECT_COLORS);
    const bool gsplat = from.convention == SPLAT_CONVENTION_GSPLAT;
    desc.convention = gsplat ? raster::Convention::kGsplat
                      : from.convention == SPLAT_CONVENTION_RAY_MAXIMUM
                          ? raster::Convention::kRayMaximum
                          : raster::Convention::k3dgs;
    desc.antialiased = is_set(SPLAT_RASTERIZER_ANTIALIASED);
    desc.sort_by_distance = is_set(SPLAT_RASTERIZER_SORT_BY_DISTANCE);
    desc.cut_3_sigma = is_set(SPLAT_RASTERIZER_CUT_3_SIGMA);
    desc.near_plane = gsplat ? raster::kNearGsplat : raster::kNear3dgs;
    if (from.near_plane != 0) desc.near_plane = from.near_plane;
    if (from.far_plane != 0) desc.far_plane = from.far_plane;
    if (from.items != 0) desc.most_items = from.items;
    desc.extra = is_set(SPLAT_RASTERIZER_DEPTH) || is_set(SPLAT_RASTERIZER_IDS);
    desc.median = is_set(SPLAT_RASTERIZER_MEDIAN_DEPTH);
    desc.normals = is_set(SPLAT_RASTERIZER_NORMALS);
    desc.original_gradient = is_set(SPLAT_RASTERIZER_ORIGINAL_GRADIENT);
    desc.grad_depth = is_set(SPLAT_RASTERIZER_GRAD_DEPTH);
    desc.grad_intrinsics = is_set(SPLAT_RASTERIZER_GRAD_INTRINSICS);
    desc.grad_pose = is_set(SPLAT_RASTERIZER_GRAD_POSE) || desc.grad_intrinsics;
    desc.contributions = is_set(SPLAT_RASTERIZER_CONTRIBUTIONS);
    desc.ids = is_set(SPLAT_RASTERIZER_IDS);
    desc.export_gradients = is_set(SPLAT_RASTERIZER_GRAD_MEANS2D);
    desc.backward = is_set(SPLAT_RASTERIZER_BACKWARD) || desc.grad_depth || desc.grad_pose ||
                    desc.export_gradients || desc.contributions;
    desc.skips.opacity_extent = skips(SPLAT_SKIP_OPACITY_EXTENT);
    desc.skips.exact_tiles = skips(SPLAT_SKIP_EXACT_TILES);
    desc.skips.cull = skips(SPLAT_SKIP_CULL);
    desc.skips.blocks = skips(SPLAT_SKIP_BLOCKS);
    desc.skips.early_out = skips(SPLAT_SKIP_EARLY_OUT);
    desc.skips.unchanged = skips(SPLAT_SKIP_UNCHANGED);
    return desc;
}

raster::RasterDesc api::band_desc(const vk::DeviceInfo& device, raster::RasterDesc desc) {
    // Large bands need much of the memory, small ones are many.
    constexpr std::uint64_t kBand = 1U << 22;
    const std::uint64_t most = raster::most_items(device, desc);
    if (desc.views == 1 && !desc.backward && !desc.ids && desc.items() > most)
        desc.gaussians = static_cast<std::uint32_t>(
            std::min<std::uint64_t>(most, std::max<std::uint64_t>(kBand, desc.gaussians / 4)));
    return desc;
}

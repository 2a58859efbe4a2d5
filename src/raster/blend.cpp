#include "raster/blend.h"

#include <cmath>
#include <numeric>

#include "params/blend_params.h"
#include "raster/tile_bin.h"
#include "raster_constants.h"
#include "vk/launch.h"

namespace splat::raster {
namespace {

constexpr std::uint32_t kTilePixels = kTileSize * kTileSize;

/// A step of about 0.618 * total that visits each of `total` rows of tiles once. Any run of
/// consecutive steps then spreads evenly over the rows.
std::uint32_t spread_of(std::uint64_t total) {
    auto step = static_cast<std::uint64_t>(0.6180339887 * static_cast<double>(total));
    while (step > 1 && std::gcd(step, total) != 1) --step;
    const bool fits = step * total < (std::uint64_t{1} << 32);  // the product is taken in 32 bits
    return fits && step > 0 ? static_cast<std::uint32_t>(step) : 1;
}

params::BlendParams blend_params(const vk::Recorder& recorder, const RasterDesc& desc,
                                 const Window& window) {
    params::BlendParams params{};
    params.width = desc.width;
    params.height = desc.height;
    params.tiles_x = desc.tiles_x();
    params.row_begin = window.row_begin;
    params.rows = window.rows();
    params.views = desc.views;
    params.spread = tile_order_used(recorder, desc, window)
                        ? 0
                        : spread_of(std::uint64_t{window.rows()} * desc.views);
    // 3dgs stops before T < the limit, gsplat before T <= the limit.
    params.stop_below = desc.convention == Convention::k3dgs
                            ? kTransmittanceMin
                            : std::nextafter(kTransmittanceMin, 1.0F);
    params.straight_through = desc.original_gradient ? 1 : 0;
    params.gaussians = desc.gaussians;
    return params;
}

}  // namespace

Status blend_forward(vk::Recorder& recorder, const RasterDesc& desc, const Window& window,
                     const BlendViews& views, std::uint64_t pairs_estimate, bool normals) {
    const bool cpu = recorder.kernels() == vk::Kernels::kCpu;
    const std::uint32_t parts = cpu ? 4 : 1;
    const auto pairs = static_cast<double>(pairs_estimate);
    std::vector<vk::SpecConstant> constants = {
        {params::kWorkgroupSizeId, cpu ? 8 : kTilePixels},
        {params::kBlendExtraId, desc.extra && !normals ? 1U : 0U},
        {params::kBlendNormalsId, normals ? 1U : 0U},
        {params::kBlendSizesId, desc.view_sizes ? 1U : 0U},
        {params::kBlendIdsId, desc.ids && !normals ? 1U : 0U}};
    if (recorder.kernels() != vk::Kernels::kPlain)
        constants.push_back({params::kBlendEarlyOutId, desc.skips.early_out ? 1U : 0U});
    if (cpu) constants.push_back({params::kBlendSkipBlocksId, desc.skips.blocks ? 1U : 0U});
    std::vector<vk::Access> accesses = {vk::read(views.splats),     vk::read(views.pairs),
                                        vk::read(views.normals),    vk::read(views.ranges),
                                        vk::read(views.background), vk::write(views.image),
                                        vk::write(views.state),     vk::write(views.extra)};
    if (cpu) accesses.push_back(vk::read(views.order));
    return recorder.dispatch({
        .op = "blend_forward",
        .shader = "blend_forward",
        .constants = constants,
        .push = blend_params(recorder, desc, window),
        .accesses = accesses,
        .groups = {desc.tiles_x() * parts, window.rows(), desc.views},
        .work = {.flops = 20 * pairs * kTilePixels,
                 .bytes = 60 * pairs + 24 * static_cast<double>(desc.pixels())},
    });
}

Status blend_backward(vk::Recorder& recorder, const RasterDesc& desc, const Window& window,
                      const BlendViews& views, const vk::BufferView& grad_image,
                      const vk::BufferView& grad_depth, const RecordViews& records,
                      std::uint64_t pairs_estimate) {
    vk::Kernels kernels = recorder.kernels();
    if (kernels == vk::Kernels::kGpu && !recorder.device().features.subgroup_arithmetic)
        kernels = vk::Kernels::kPlain;
    const bool cpu = kernels == vk::Kernels::kCpu;
    const auto pairs = static_cast<double>(pairs_estimate);
    std::vector<vk::SpecConstant> constants = {
        {params::kWorkgroupSizeId, cpu ? 8 : kTilePixels},
        {params::kBlendDepthId, desc.grad_depth ? 1U : 0U},
        {params::kBlendAbsoluteId, desc.export_gradients ? 1U : 0U},
        {params::kBlendSizesId, desc.view_sizes ? 1U : 0U},
        {params::kBlendContributionsId, desc.contributions ? 1U : 0U}};
    std::vector<vk::Access> accesses = {
        vk::read(views.splats), vk::read(views.pairs),      vk::read(views.slots),
        vk::read(views.ranges), vk::read(views.background), vk::read(views.state),
        vk::read(grad_image),   vk::read(grad_depth),       vk::write(records.a),
        vk::write(records.b),   vk::write(records.c),       vk::write(records.d)};
    if (kernels != vk::Kernels::kPlain)
        constants.push_back({params::kBlendEarlyOutId, desc.skips.early_out ? 1U : 0U});
    if (cpu) {
        constants.push_back({params::kBlendSkipBlocksId, desc.skips.blocks ? 1U : 0U});
        constants.push_back({params::kBlendStraightThroughId, desc.original_gradient ? 1U : 0U});
        accesses.push_back(vk::read(views.order));
    }
    return recorder.dispatch({
        .op = "blend_backward",
        .shader = "blend_backward",
        .constants = constants,
        .push = blend_params(recorder, desc, window),
        .accesses = accesses,
        .groups = {desc.tiles_x(), window.rows(), desc.views},
        .work = {.flops = 40 * pairs * kTilePixels,
                 .bytes = 108 * pairs + 24 * static_cast<double>(desc.pixels())},
        .kernels = kernels,
    });
}

}  // namespace splat::raster

#include "raster/blend.h"

#include <algorithm>
#include <bit>
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
                                 const Window& window, const ListPart& part) {
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
    // gsplat stops before T <= the limit, the others before T < the limit.
    params.stop_below = desc.convention == Convention::kGsplat
                            ? std::nextafter(kTransmittanceMin, 1.0F)
                            : kTransmittanceMin;
    params.straight_through = desc.original_gradient ? 1 : 0;
    params.gaussians = desc.ranges.used ? 0 : desc.gaussians;  // see item_of_first() in blend.glsl
    params.part_begin = part.begin;
    params.part_entries = part.entries;
    params.rays = static_cast<std::uint32_t>(3 * desc.items());
    params.near_plane = desc.near_plane;
    return params;
}

vk::Kernels kernels_of(const vk::DeviceInfo& device, vk::Kernels kernels, bool backward) {
    const vk::DeviceFeatures& has = device.features;
    const bool fits =
        has.subgroup_ballot && (!backward || (has.subgroup_arithmetic && has.subgroup_shuffle));
    return kernels == vk::Kernels::kGpu && !fits ? vk::Kernels::kPlain : kernels;
}

/// Pairs that a part walks at most, of all in the window.
double pairs_of(const RasterDesc& desc, const Window& window, const ListPart& part,
                std::uint64_t pairs) {
    const auto all = static_cast<double>(pairs);
    // Each tile that goes on has as many as before in every part before.
    const double before = part.of_long_lists ? std::max(1U, part.begin / part.entries) : 1;
    const double tiles = double{1} * desc.tiles_x() * window.rows() * desc.views;
    return std::min(all / before, tiles * part.entries);
}

vk::Work forward_work(double pairs, double pixels) {
    return {.flops = 20 * pairs * kTilePixels, .bytes = 60 * pairs + 24 * pixels};
}

vk::Work backward_work(double pairs, double pixels) {
    return {.flops = 40 * pairs * kTilePixels, .bytes = 108 * pairs + 24 * pixels};
}

}  // namespace

vk::KernelPace& blend_pace(vk::Context& context, bool backward) {
    vk::Device& device = context.device();
    const vk::Kernels kernels =
        kernels_of(device.info(), device.kernels(vk::Family::kBlend), backward);
    return device.pace.of(
        vk::module_for(backward ? "blend_backward" : "blend_forward", kernels)->name);
}

std::uint32_t part_entries(vk::Context& context, bool backward) {
    const vk::Device& device = context.device();
    const vk::Kernels kernels =
        kernels_of(device.info(), device.kernels(vk::Family::kBlend), backward);
    // The most on lavapipe, which ends loops after 65535 turns: kernels for CPUs take up to 2 for 8 entries forward and
    // 33 backward, those for GPUs 9 and 42 for 6 backward, with 8 lanes. 4096 of plain ones take it 0.2 s backward.
    const std::uint32_t most = kernels == vk::Kernels::kGpu ? (backward ? 8192 : 16384)
                               : kernels == vk::Kernels::kCpu
                                   ? (backward ? 62 * kTilePixels : 65536)
                                   : 4096;
    const vk::Work work = backward ? backward_work(most, 0) : forward_work(most, 0);
    const double seconds =
        estimated_seconds(device.info(), kernels, work) * blend_pace(context, backward).factor;
    const double fit = device.pace.submit_seconds() / seconds;
    if (fit >= 1) return most;
    return std::bit_floor(std::max(static_cast<std::uint32_t>(most * fit), kTilePixels));
}

Status blend_forward(vk::Recorder& recorder, const RasterDesc& desc, const Window& window,
                     const BlendViews& views, std::uint64_t pairs_estimate, bool normals,
                     const ListPart& part) {
    vk::Kernels kernels =
        kernels_of(recorder.device(), recorder.kernels(vk::Family::kBlend), false);
    // Ray forms make a batch of the kernel for GPUs 64 bytes a pixel of shared memory; devices need not have more.
    if (desc.rays() && kernels == vk::Kernels::kGpu &&
        recorder.device().limits.shared_memory_bytes <= 64 * kTilePixels)
        kernels = vk::Kernels::kPlain;
    const bool cpu = kernels == vk::Kernels::kCpu;
    const std::uint32_t quarters = cpu ? 4 : 1;
    const double pairs = pairs_of(desc, window, part, pairs_estimate);
    std::vector<vk::SpecConstant> constants = {
        {params::kWorkgroupSizeId, cpu ? 8 : kTilePixels},
        {params::kBlendExtraId, desc.extra && !normals ? 1U : 0U},
        {params::kBlendNormalsId, normals ? 1U : 0U},
        {params::kBlendSizesId, desc.view_sizes ? 1U : 0U},
        {params::kBlendIdsId, desc.ids && !normals ? 1U : 0U},
        {params::kBlendCutId, desc.cut_3_sigma ? 1U : 0U},
        {params::kBlendMedianId, desc.median && !normals ? 1U : 0U},
        {params::kBlendRaysId, desc.rays() ? 1U : 0U}};
    if (kernels != vk::Kernels::kPlain) {
        constants.push_back({params::kBlendEarlyOutId, desc.skips.early_out ? 1U : 0U});
        constants.push_back({params::kBlendSkipBlocksId, desc.skips.blocks ? 1U : 0U});
    }
    std::vector<vk::Access> accesses = {
        vk::read(views.splats),      vk::read(views.pairs),       vk::read(views.normals),
        vk::read(views.ranges),      vk::read(views.background),  vk::read_write(views.image),
        vk::read_write(views.state), vk::read_write(views.extra), vk::read_write(views.median)};
    if (part.of_long_lists) constants.push_back({params::kBlendPartsId, 1});
    if (cpu) accesses.push_back(vk::read(views.order));
    return recorder.dispatch({
        .op = "blend_forward",
        .shader = "blend_forward",
        .constants = constants,
        .push = blend_params(recorder, desc, window, part),
        .accesses = accesses,
        .groups = {desc.tiles_x() * quarters, window.rows(), desc.views},
        .work = forward_work(pairs, static_cast<double>(desc.pixels())),
        .most_group = forward_work(std::min<double>(pairs, part.entries) / quarters, 0),
        .kernels = kernels,
    });
}

Status blend_backward(vk::Recorder& recorder, const RasterDesc& desc, const Window& window,
                      const BlendViews& views, const vk::BufferView& grad_image,
                      const vk::BufferView& grad_depth, const RecordViews& records,
                      std::uint64_t pairs_estimate, const ListPart& part) {
    const vk::Kernels kernels =
        kernels_of(recorder.device(), recorder.kernels(vk::Family::kBlend), true);
    const bool cpu = kernels == vk::Kernels::kCpu;
    const double pairs = pairs_of(desc, window, part, pairs_estimate);
    std::vector<vk::SpecConstant> constants = {
        {params::kWorkgroupSizeId, cpu ? 8 : kTilePixels},
        {params::kBlendDepthId, desc.grad_depth ? 1U : 0U},
        {params::kBlendAbsoluteId, desc.export_gradients ? 1U : 0U},
        {params::kBlendSizesId, desc.view_sizes ? 1U : 0U},
        {params::kBlendContributionsId, desc.contributions ? 1U : 0U},
        {params::kBlendCutId, desc.cut_3_sigma ? 1U : 0U}};
    std::vector<vk::Access> accesses = {vk::read(views.splats),     vk::read(views.pairs),
                                        vk::read(views.slots),      vk::read(views.ranges),
                                        vk::read(views.background), vk::read(views.state),
                                        vk::read(grad_image),       vk::read(grad_depth)};
    accesses.push_back(vk::read_write(records.sums[0]));
    for (std::size_t i = 1; i < records.sums.size(); ++i)
        accesses.push_back(vk::write(records.sums[i]));
    if (part.of_long_lists) constants.push_back({params::kBlendPartsId, 1});
    if (kernels != vk::Kernels::kPlain) {
        constants.push_back({params::kBlendEarlyOutId, desc.skips.early_out ? 1U : 0U});
        constants.push_back({params::kBlendSkipBlocksId, desc.skips.blocks ? 1U : 0U});
    }
    if (kernels == vk::Kernels::kGpu)
        constants.push_back(
            {params::kBlendMaxSubgroupsId, recorder.device().limits.subgroups(kTilePixels)});
    if (cpu) {
        constants.push_back({params::kBlendStraightThroughId, desc.original_gradient ? 1U : 0U});
        accesses.push_back(vk::read(views.order));
    }
    return recorder.dispatch({
        .op = "blend_backward",
        .shader = "blend_backward",
        .constants = constants,
        .push = blend_params(recorder, desc, window, part),
        .accesses = accesses,
        .groups = {desc.tiles_x(), window.rows(), desc.views},
        .work = backward_work(pairs, static_cast<double>(desc.pixels())),
        .most_group = backward_work(std::min<double>(pairs, part.entries), 0),
        .kernels = kernels,
    });
}

}  // namespace splat::raster

#include <algorithm>

#include "core/checked_math.h"
#include "ops/conv2d_stages.h"
#include "ops/gpu_tiles.h"
#include "ops/winograd_slices.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

using vk::BufferView;

/// conv2d_winograd_backward_weight_product_cpu.comp: 32 q input by 32 / q output channels, q = 1 or 2.
constexpr std::uint32_t kWeightTile = 32;

/// Products of slices that are kept to be summed together: more of them save passes over grad_weight but
/// cost memory.
constexpr std::uint64_t kProductsBytes = std::uint64_t{64} << 20;
constexpr std::uint64_t kMostProducts = 8;
/// On a GPU the sum of a single slice is cut into parts until there are this many workgroups, or a part has only
/// this many tiles: 64 to 64 channels are 36 workgroups at first, too few for its processors.
constexpr std::uint64_t kGpuGroups = 2 * kProductGroups;
constexpr std::uint64_t kGpuPartTiles = 64;

/// Two quads of input channels per lane, unless half of the last tile would be empty.
std::uint32_t quads_per_lane(std::uint32_t in_channels) {
    return (in_channels - 1) % (2 * kWeightTile) >= kWeightTile ? 2 : 1;
}

/// V, D and the products of one round of slices, consecutive.
struct Round {
    WinogradSlices slices;
    std::uint32_t products;  ///< slices of a round
    std::uint32_t parts;     ///< parts of a slice's sum, each with a product of its own
    std::uint64_t input_bytes;
    std::uint64_t grad_bytes;
    std::uint64_t product_bytes;  ///< bytes of the products of one slice
};

Round round_of(const vk::Recorder& recorder, const Conv2dDesc& desc) {
    Round round{};
    round.slices = winograd_slices(recorder, desc);
    round.input_bytes = round.slices.bytes(desc, desc.in_channels);
    round.grad_bytes = round.slices.bytes(desc, desc.out_channels);
    round.product_bytes = std::uint64_t{winograd_places(desc)} * desc.out_channels *
                          round_up(desc.in_channels, 4) * 4;
    const std::uint64_t most =
        std::clamp<std::uint64_t>(kProductsBytes / round.product_bytes, 1, kMostProducts);
    round.products = static_cast<std::uint32_t>(
        std::min<std::uint64_t>(most, ceil_div(round.slices.all, round.slices.tiles)));
    round.parts = 1;
    if (recorder.kernels() == vk::Kernels::kGpu && round.slices.all <= round.slices.tiles) {
        const std::uint64_t groups =
            winograd_places(desc) * product_groups(desc.in_channels, desc.out_channels, 64);
        round.parts = static_cast<std::uint32_t>(
            std::min({ceil_div(kGpuGroups, groups), ceil_div(round.slices.all, kGpuPartTiles),
                      kProductsBytes / round.product_bytes + 1}));
    }
    return round;
}

/// Specialisation and workgroups of the product of one slice.
std::pair<std::vector<vk::SpecConstant>, vk::Groups> product_launch(const vk::Recorder& recorder,
                                                                    const Conv2dDesc& desc,
                                                                    const Round& round) {
    const std::uint32_t places = winograd_places(desc) * round.parts;
    if (recorder.kernels() == vk::Kernels::kGpu) {
        const ProductTiles tiles =
            product_tiles(recorder.device(), desc.in_channels, desc.out_channels, places, false);
        return {tiles.constants(), {tiles.m, tiles.n, places}};
    }
    const std::uint32_t quads = quads_per_lane(desc.in_channels);
    const std::uint64_t in_tile = std::uint64_t{kWeightTile} * quads * (round.slices.lanes / 8);
    return {{{params::kWorkgroupSizeId, round.slices.lanes}, {params::kWinogradQuadsId, quads}},
            {static_cast<std::uint32_t>(ceil_div(desc.in_channels, in_tile)),
             static_cast<std::uint32_t>(ceil_div(desc.out_channels, kWeightTile / quads)), places}};
}

/// product[params.slice] = D V^T over one slice of tiles.
Status add_product(vk::Recorder& recorder, const Conv2dDesc& desc, const Round& round,
                   const params::Conv2dWinogradParams& params, const BufferView& x,
                   const BufferView& grad_y, const BufferView& workspace,
                   const BufferView& products) {
    const WinogradSlices& slices = round.slices;
    const BufferView input = workspace.part(0, round.input_bytes);
    const BufferView grad = workspace.part(round.input_bytes, round.grad_bytes);
    SPLAT_TRY(
        winograd_input(recorder, "conv2d_backward_weight_input", desc, slices, params, x, input));
    SPLAT_TRY(recorder.dispatch({
        .op = "conv2d_backward_weight_grad",
        .shader = "conv2d_winograd_backward_weight_input",
        .constants = winograd_transform(recorder, desc, slices),
        .push = params,
        .accesses = {vk::read(grad_y), vk::write(grad)},
        .groups = {slices.groups(params.tiles), winograd_parts(recorder, desc.out_channels), 1},
        .work = {.flops = 0, .bytes = 2.0 * static_cast<double>(grad.bytes)},
    }));
    const vk::Work work = conv2d_work(desc);
    const double share = static_cast<double>(params.tiles) / slices.all;
    auto [constants, groups] = product_launch(recorder, desc, round);
    return recorder.dispatch({
        .op = "conv2d_backward_weight",
        .shader = "conv2d_winograd_backward_weight_product",
        .constants = std::move(constants),
        .push = params,
        .accesses = {vk::read(input), vk::read(grad), vk::write(products)},
        .groups = groups,
        .work = {.flops = work.flops * share, .bytes = work.bytes * share},
    });
}

}  // namespace

std::uint64_t winograd_backward_weight_bytes(const vk::Recorder& recorder, const Conv2dDesc& desc) {
    const Round round = round_of(recorder, desc);
    return round.input_bytes + round.grad_bytes +
           round_up(round.products * round.parts * round.product_bytes, 256);
}

Status winograd_backward_weight(vk::Recorder& recorder, const Conv2dDesc& desc, const BufferView& x,
                                const BufferView& grad_y, const BufferView& grad_weight,
                                const BufferView& workspace, bool accumulate) {
    const Round round = round_of(recorder, desc);
    const WinogradSlices& slices = round.slices;
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const std::uint64_t quads = desc.out_channels * ceil_div(desc.in_channels, 4);
    const vk::Groups per_quad = vk::groups_for(recorder.device(), quads, size);
    for (std::uint32_t first = 0; first < slices.all;) {
        params::Conv2dWinogradParams params = winograd_params(desc);
        params.stride = slices.tiles;
        params.groups_x = per_quad[0];
        const bool later = accumulate || first > 0;
        const std::uint32_t left =
            static_cast<std::uint32_t>(ceil_div(slices.all - first, slices.tiles));
        const std::uint32_t slices_here = std::min(round.products, left);
        params.slices = slices_here * round.parts;
        const BufferView products = workspace.part(round.input_bytes + round.grad_bytes,
                                                   params.slices * round.product_bytes);
        for (params.slice = 0; params.slice < slices_here; ++params.slice) {
            params.first_tile = first;
            params.tiles = std::min(slices.tiles, slices.all - first);
            params.part_tiles =
                static_cast<std::uint32_t>(round_up(ceil_div(params.tiles, round.parts), 8));
            SPLAT_TRY(add_product(recorder, desc, round, params, x, grad_y, workspace, products));
            first += params.tiles;
        }
        SPLAT_TRY(recorder.dispatch({
            .op = "conv2d_backward_weight_output",
            .shader = "conv2d_winograd_backward_weight_output",
            .constants = {{params::kWorkgroupSizeId, size},
                          winograd_tile(desc),
                          {params::kWinogradAccumulateId, later ? 1U : 0U},
                          {params::kWinogradWholeId, desc.in_channels % 4 == 0 ? 1U : 0U}},
            .push = params,
            .accesses = {vk::read(products), vk::read_write(grad_weight)},
            .groups = per_quad,
            .work = {.flops = 0, .bytes = static_cast<double>(products.bytes)},
        }));
    }
    return {};
}

}  // namespace splat::ops

#include <algorithm>

#include "core/checked_math.h"
#include "ops/conv2d_stages.h"
#include "ops/gpu_tiles.h"
#include "ops/winograd_slices.h"
#include "params/conv2d_winograd_params.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

using vk::BufferView;
using vk::Kernels;

/// Runs of 512 bytes take half the time of runs of 128 to prepare, on Zen 4.
constexpr std::uint32_t kPackedQuads = 4;

/// V and M of one slice, consecutive.
struct Workspace {
    BufferView input;
    BufferView product;
};

/// Specialisation and workgroups of the product of `tiles` tiles.
struct Launch {
    std::vector<vk::SpecConstant> constants;
    vk::Groups groups;
};
Launch product_launch(const vk::Recorder& recorder, const Conv2dDesc& desc,
                      const WinogradSlices& slices, std::uint32_t tiles) {
    const std::uint32_t places = winograd_places(desc);
    if (recorder.kernels() == Kernels::kGpu) {
        const ProductTiles product =
            product_tiles(recorder.device(), desc.out_channels, tiles, places, true);
        return {product.constants(), {product.m, product.n, places}};
    }
    return {
        {{params::kWorkgroupSizeId, slices.lanes},
         {params::kWinogradColumnsId, slices.columns},
         {params::kWinogradBlocksId, slices.blocks},
         {params::kWinogradDepthId, slices.depth}},
        {slices.groups(tiles) / slices.columns,
         static_cast<std::uint32_t>(ceil_div(desc.out_channels, std::uint64_t{8} * slices.blocks)),
         places}};
}

}  // namespace

std::uint64_t winograd_weight_bytes(const Conv2dDesc& desc) {
    return std::uint64_t{winograd_places(desc)} * round_up(desc.out_channels, 8) *
           round_up(desc.in_channels, 8) * 4;
}

Status winograd_prepare_weight(vk::Recorder& recorder, const Conv2dDesc& desc,
                               const BufferView& weight, const BufferView& prepared,
                               bool transposed) {
    const Conv2dDesc product = transposed ? conv2d_transposed(desc) : desc;
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const std::uint32_t quads = recorder.kernels() == Kernels::kCpu ? kPackedQuads : 1;
    const std::uint64_t runs = ceil_div(round_up(product.in_channels, 8), std::uint64_t{4} * quads);
    const vk::Groups groups =
        vk::groups_for(recorder.device(), round_up(product.out_channels, 8) * runs, size);
    params::Conv2dWinogradParams params = winograd_params(product);
    params.transposed = transposed ? 1 : 0;
    params.groups_x = groups[0];
    return recorder.dispatch({
        .op = "conv2d_pack_weight",
        .shader = "conv2d_winograd_forward_weight",
        .constants = {{params::kWorkgroupSizeId, size},
                      winograd_tile(desc),
                      {params::kWinogradPackedQuadsId, quads},
                      {params::kWinogradWholeId,
                       !transposed && desc.in_channels % 4 == 0 ? 1U : 0U}},
        .push = params,
        .accesses = {vk::read(weight), vk::write(prepared)},
        .groups = groups,
        .work = {.flops = 0, .bytes = 1.25 * static_cast<double>(winograd_weight_bytes(desc))},
    });
}

std::uint64_t winograd_forward_bytes(const vk::Recorder& recorder, const Conv2dDesc& desc) {
    const WinogradSlices slices = winograd_slices(recorder, desc);
    return slices.bytes(desc, desc.in_channels) + slices.bytes(desc, desc.out_channels);
}

Status winograd_input(vk::Recorder& recorder, const char* op, const Conv2dDesc& desc,
                      const WinogradSlices& slices, params::Conv2dWinogradParams params,
                      const BufferView& x, const BufferView& transformed) {
    std::vector<vk::SpecConstant> constants = winograd_transform(recorder, desc, slices);
    constants.push_back({params::kWinogradReplicateId, desc.replicate ? 1U : 0U});
    return recorder.dispatch({
        .op = op,
        .shader = "conv2d_winograd_forward_input",
        .constants = std::move(constants),
        .push = params,
        .accesses = {vk::read(x), vk::write(transformed)},
        .groups = {slices.groups(params.tiles), winograd_parts(recorder, desc.in_channels), 1},
        .work = {.flops = 0, .bytes = 2.0 * static_cast<double>(transformed.bytes)},
    });
}

Status winograd_forward(vk::Recorder& recorder, const WinogradLabels& labels,
                        const Conv2dDesc& desc, const BufferView& x, const BufferView& weight,
                        const BufferView& bias, const BufferView& residual, const BufferView& y,
                        const BufferView& workspace) {
    const WinogradSlices slices = winograd_slices(recorder, desc);
    const std::uint64_t input_bytes = slices.bytes(desc, desc.in_channels);
    const Workspace space{workspace.part(0, input_bytes),
                          workspace.part(input_bytes, slices.bytes(desc, desc.out_channels))};
    const auto quads = static_cast<std::uint32_t>(ceil_div(desc.out_channels, 4));
    const vk::Work work = conv2d_work(desc);
    const auto tile = static_cast<std::uint32_t>(desc.winograd);
    const bool exact = desc.height % tile == 0 && desc.width % tile == 0 && slices.all % 8 == 0;
    const bool has_residual = residual.block != nullptr;
    for (std::uint32_t first = 0; first < slices.all; first += slices.tiles) {
        params::Conv2dWinogradParams params = winograd_params(desc);
        params.first_tile = first;
        params.tiles = std::min(slices.tiles, slices.all - first);
        params.stride = slices.tiles;
        SPLAT_TRY(winograd_input(recorder, labels.input, desc, slices, params, x, space.input));
        const double share = static_cast<double>(params.tiles) / slices.all;
        const Launch launch = product_launch(recorder, desc, slices, params.tiles);
        SPLAT_TRY(recorder.dispatch({
            .op = labels.product,
            .shader = "conv2d_winograd_forward_product",
            .constants = launch.constants,
            .push = params,
            .accesses = {vk::read(space.input), vk::read(weight), vk::write(space.product)},
            .groups = launch.groups,
            .work = {.flops = work.flops * share, .bytes = work.bytes * share},
        }));
        SPLAT_TRY(recorder.dispatch({
            .op = labels.output,
            .shader = "conv2d_winograd_forward_output",
            .constants = {{params::kWorkgroupSizeId, slices.lanes},
                          winograd_tile(desc),
                          {params::kWinogradResidualId, has_residual ? 1U : 0U},
                          {params::kWinogradExactId, exact ? 1U : 0U}},
            .push = params,
            .accesses = {vk::read(space.product), vk::read(bias),
                         vk::read(has_residual ? residual : x), vk::write(y)},
            .groups = {slices.groups(params.tiles), quads, 1},
            .work = {.flops = 0, .bytes = 2.0 * static_cast<double>(space.product.bytes)},
        }));
    }
    return {};
}

}  // namespace splat::ops

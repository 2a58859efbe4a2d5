#include <algorithm>

#include "core/checked_math.h"
#include "ops/conv2d_stages.h"
#include "ops/gpu_tiles.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

using vk::BufferView;
using vk::Kernels;

/// conv2d_forward_fast.comp: rows of pixels of one invocation.
constexpr std::uint32_t kRows = 4;
/// conv2d_backward_weight_fast.comp: channels of a tile, both ways.
constexpr std::uint32_t kTile = 32;

/// Slices of the rows of pixels in the weight gradient: enough that none takes more turns than kMaxTurns
/// and, for the fast kernels, that every core or multiprocessor has work.
std::uint32_t slices_of(const vk::Recorder& recorder, const Conv2dDesc& desc) {
    const std::uint64_t rows = std::uint64_t{desc.n} * desc.height;
    const std::uint64_t least =
        ceil_div(rows, std::max<std::uint64_t>(vk::kMaxTurns / desc.width, 1));
    if (recorder.kernels() == Kernels::kPlain) return static_cast<std::uint32_t>(least);
    const std::uint64_t tiles =
        9 * ceil_div(desc.in_channels, kTile) * ceil_div(desc.out_channels, kTile);
    const std::uint64_t busy = recorder.kernels() == Kernels::kCpu ? 16 : 512;
    return static_cast<std::uint32_t>(
        std::max(least, std::min(ceil_div(busy, tiles), ceil_div(rows, 16))));
}

Status fast_forward(vk::Recorder& recorder, const char* op, const Conv2dDesc& desc,
                    const BufferView& x, const BufferView& weight, const BufferView& bias,
                    const BufferView& residual, const BufferView& y) {
    const bool cpu = recorder.kernels() == Kernels::kCpu;
    const std::uint32_t size = cpu ? 8 : vk::workgroup_size(recorder.device(), 64);
    const std::uint64_t blocks = ceil_div(desc.width, 8) * ceil_div(desc.height, kRows);
    params::Conv2dParams params = conv2d_params(desc);
    params.has_residual = residual.block != nullptr ? 1 : 0;
    return recorder.dispatch({
        .op = op,
        .shader = "conv2d_forward",
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params,
        .accesses = {vk::read(x), vk::read(weight), vk::read(bias),
                     vk::read(params.has_residual != 0 ? residual : x), vk::write(y)},
        .groups = {static_cast<std::uint32_t>(ceil_div(blocks, size / 8)),
                   static_cast<std::uint32_t>(ceil_div(desc.out_channels, 8)), desc.n},
        .work = conv2d_work(desc),
    });
}

}  // namespace

std::uint64_t direct_weight_bytes(const vk::Recorder& recorder, const Conv2dDesc& desc) {
    if (recorder.kernels() == Kernels::kPlain) return 0;
    return 36 * round_up(desc.in_channels, 4) * round_up(desc.out_channels, 8);
}

Status direct_prepare_weight(vk::Recorder& recorder, const Conv2dDesc& desc,
                             const BufferView& weight, const BufferView& prepared,
                             bool transposed) {
    const Conv2dDesc product = transposed ? conv2d_transposed(desc) : desc;
    const std::uint64_t bytes = direct_weight_bytes(recorder, product);
    if (bytes == 0) return {};
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups groups = vk::groups_for(recorder.device(), bytes / 16, size);
    params::Conv2dParams params = conv2d_params(product);
    params.transposed = transposed ? 1 : 0;
    params.groups_x = groups[0];
    return recorder.dispatch({
        .op = "conv2d_pack_weight",
        .shader = "conv2d_pack_weight",
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params,
        .accesses = {vk::read(weight), vk::write(prepared)},
        .groups = groups,
        .work = {.flops = 0, .bytes = 2.0 * static_cast<double>(bytes)},
    });
}

Status direct_forward(vk::Recorder& recorder, const char* op, const Conv2dDesc& desc,
                      const BufferView& x, const BufferView& weight, const BufferView& bias,
                      const BufferView& residual, const BufferView& y) {
    if (recorder.kernels() != Kernels::kPlain)
        return fast_forward(recorder, op, desc, x, weight, bias, residual, y);
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups groups = vk::groups_for(
        recorder.device(), ceil_div(desc.out_channels, 4) * conv2d_pixels(desc), size);
    params::Conv2dParams params = conv2d_params(desc);
    params.has_residual = residual.block != nullptr ? 1 : 0;
    params.groups_x = groups[0];
    return recorder.dispatch({
        .op = op,
        .shader = "conv2d_forward",
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params,
        .accesses = {vk::read(x), vk::read(weight), vk::read(bias),
                     vk::read(params.has_residual != 0 ? residual : x), vk::write(y)},
        .groups = groups,
        .work = conv2d_work(desc),
    });
}

Status direct_backward_input(vk::Recorder& recorder, const Conv2dDesc& desc,
                             const BufferView& weight, const BufferView& grad_y,
                             const BufferView& grad_x, const BufferView& addend) {
    if (recorder.kernels() != Kernels::kPlain)
        return fast_forward(recorder, "conv2d_backward_input", conv2d_transposed(desc), grad_y,
                            weight, weight, addend, grad_x);
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups groups = vk::groups_for(
        recorder.device(), ceil_div(desc.in_channels, 4) * conv2d_pixels(desc), size);
    params::Conv2dParams params = conv2d_params(desc);
    params.groups_x = groups[0];
    return recorder.dispatch({
        .op = "conv2d_backward_input",
        .shader = "conv2d_backward_input",
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params,
        .accesses = {vk::read(weight), vk::read(grad_y), vk::write(grad_x)},
        .groups = groups,
        .work = conv2d_work(desc),
    });
}

std::uint64_t direct_backward_weight_bytes(const vk::Recorder& recorder, const Conv2dDesc& desc) {
    return std::uint64_t{slices_of(recorder, desc)} * 9 * desc.out_channels *
           round_up(desc.in_channels, 4) * 4;
}

Status direct_backward_weight(vk::Recorder& recorder, const Conv2dDesc& desc, const BufferView& x,
                              const BufferView& grad_y, const BufferView& grad_weight,
                              const BufferView& workspace, bool accumulate) {
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups per_weight = vk::groups_for(
        recorder.device(), std::uint64_t{9} * desc.in_channels * desc.out_channels, size);
    params::Conv2dParams params = conv2d_params(desc);
    params.accumulate = accumulate ? 1 : 0;
    params.groups_x = per_weight[0];
    params.slices = slices_of(recorder, desc);
    const BufferView partial = workspace.part(0, direct_backward_weight_bytes(recorder, desc));

    const Kernels kernels = recorder.kernels();
    const std::uint32_t lanes = kernels == Kernels::kCpu ? 8 : size;
    vk::Groups groups{per_weight[0], per_weight[1], params.slices};
    std::vector<vk::SpecConstant> constants = {{params::kWorkgroupSizeId, lanes}};
    std::uint32_t out_tile = kTile;
    if (kernels == Kernels::kGpu) {
        const std::uint32_t quads = gpu_tiles(recorder.device()).weight_quads;
        constants.push_back({params::kConv2dOutQuadsId, quads});
        out_tile = 4 * quads;
    }
    if (kernels != Kernels::kPlain)  // each 8 lanes take a tile of their own
        groups = {static_cast<std::uint32_t>(ceil_div(desc.in_channels, kTile * (lanes / 8))),
                  static_cast<std::uint32_t>(ceil_div(desc.out_channels, out_tile)),
                  9 * params.slices};
    SPLAT_TRY(recorder.dispatch({
        .op = "conv2d_backward_weight",
        .shader = "conv2d_backward_weight",
        .constants = std::move(constants),
        .push = params,
        .accesses = {vk::read(x), vk::read(grad_y), vk::write(partial)},
        .groups = groups,
        .work = conv2d_work(desc),
    }));
    const double sums = 9.0 * params.slices * desc.in_channels * desc.out_channels;
    return recorder.dispatch({
        .op = "conv2d_backward_weight_reduce",
        .shader = "conv2d_backward_weight_reduce",
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params,
        .accesses = {vk::read(partial), vk::read_write(grad_weight)},
        .groups = per_weight,
        .work = {.flops = sums, .bytes = 4 * sums},
    });
}

}  // namespace splat::ops

#include "ops/conv2d.h"

#include <algorithm>

#include "core/checked_math.h"
#include "core/shape.h"
#include "ops/launch.h"
#include "params/conv2d_params.h"

namespace splat::ops {
namespace {

using vk::BufferView;
using vk::Kernels;

std::uint64_t pixels_of(const Conv2dDesc& desc) {
    return std::uint64_t{desc.n} * desc.height * desc.width;
}

/// A 1x1 convolution is a linear layer on the pixels.
LinearDesc linear_of(const Conv2dDesc& desc) {
    return {static_cast<std::uint32_t>(pixels_of(desc)), desc.in_channels, desc.out_channels,
            desc.bias, desc.scale};
}

params::Conv2dParams params_of(const Conv2dDesc& desc) {
    return {desc.n,
            desc.in_channels,
            desc.out_channels,
            desc.height,
            desc.width,
            desc.bias ? 1U : 0U,
            0,
            desc.scale,
            0,
            0,
            1,
            0};
}

vk::Work work_of(const Conv2dDesc& desc) {
    const auto pixels = static_cast<double>(pixels_of(desc));
    const double weights = 9.0 * desc.in_channels * desc.out_channels;
    return {.flops = 2 * pixels * weights,
            .bytes = 4 * (pixels * desc.in_channels + pixels * desc.out_channels + weights)};
}

/// Slices of the rows of pixels in the weight gradient: so many that none takes more turns than
/// kMaxTurns.
std::uint32_t slices_of(const Conv2dDesc& desc) {
    const std::uint64_t rows = std::uint64_t{desc.n} * desc.height;
    return static_cast<std::uint32_t>(
        ceil_div(rows, std::max<std::uint64_t>(kMaxTurns / desc.width, 1)));
}

}  // namespace

Status conv2d_check(const Conv2dDesc& desc) {
    if (desc.kernel != 1 && desc.kernel != 3)
        return error(Code::kInvalidArgument, "conv2d: a kernel of %u x %u, expected 1 x 1 or 3 x 3",
                     desc.kernel, desc.kernel);
    if (desc.in_channels > kMaxConv2dChannels || desc.out_channels > kMaxConv2dChannels)
        return error(Code::kUnsupported, "conv2d: %u -> %u channels, expected at most %u",
                     desc.in_channels, desc.out_channels, kMaxConv2dChannels);
    if (desc.width > kMaxConv2dWidth || desc.height > kMaxConv2dWidth)
        return error(Code::kUnsupported, "conv2d: images of %u x %u, expected at most %u x %u",
                     desc.height, desc.width, kMaxConv2dWidth, kMaxConv2dWidth);
    const std::uint64_t channels = round_up(std::max(desc.in_channels, desc.out_channels), 16);
    if (pixels_of(desc) > kMaxElements / channels)
        return error(Code::kUnsupported,
                     "conv2d: %u images of %u x %u with %u -> %u channels: a tensor has 2^31 "
                     "elements or more",
                     desc.n, desc.height, desc.width, desc.in_channels, desc.out_channels);
    return {};
}

std::uint64_t conv2d_prepared_bytes(const vk::Recorder& recorder, const Conv2dDesc& desc,
                                    bool transposed) {
    if (desc.kernel == 1) return linear_packed_bytes(recorder, linear_of(desc), transposed);
    return 0;
}

Status conv2d_prepare_weight(vk::Recorder& recorder, const Conv2dDesc& desc,
                             const BufferView& weight, const BufferView& prepared,
                             bool transposed) {
    SPLAT_TRY(conv2d_check(desc));
    if (desc.kernel == 1)
        return linear_pack_weight(recorder, linear_of(desc), weight, prepared, transposed);
    return {};
}

Status conv2d_forward(vk::Recorder& recorder, const Conv2dDesc& desc, const BufferView& x,
                      const BufferView& weight, const BufferView& bias, const BufferView& residual,
                      const BufferView& y) {
    SPLAT_TRY(conv2d_check(desc));
    if (desc.kernel == 1)
        return linear_forward(recorder, linear_of(desc), x, weight, bias, y, residual);
    const std::uint32_t size = workgroup_size(recorder.device(), 64);
    const vk::Groups groups =
        groups_for(recorder.device(), ceil_div(desc.out_channels, 4) * pixels_of(desc), size);
    params::Conv2dParams params = params_of(desc);
    params.has_residual = residual.block != nullptr ? 1 : 0;
    params.groups_x = groups[0];
    return recorder.dispatch({
        .op = "conv2d_forward",
        .shader = "conv2d_forward",
        .constants = {{kWorkgroupSizeId, size}},
        .push = params,
        .accesses = {vk::read(x), vk::read(weight), vk::read(bias),
                     vk::read(params.has_residual != 0 ? residual : x), vk::write(y)},
        .groups = groups,
        .work = work_of(desc),
    });
}

Status conv2d_backward_input(vk::Recorder& recorder, const Conv2dDesc& desc,
                             const BufferView& weight, const BufferView& grad_y,
                             const BufferView& grad_x) {
    SPLAT_TRY(conv2d_check(desc));
    if (desc.kernel == 1)
        return linear_backward_input(recorder, linear_of(desc), weight, grad_y, grad_x);
    const std::uint32_t size = workgroup_size(recorder.device(), 64);
    const vk::Groups groups =
        groups_for(recorder.device(), ceil_div(desc.in_channels, 4) * pixels_of(desc), size);
    params::Conv2dParams params = params_of(desc);
    params.groups_x = groups[0];
    return recorder.dispatch({
        .op = "conv2d_backward_input",
        .shader = "conv2d_backward_input",
        .constants = {{kWorkgroupSizeId, size}},
        .push = params,
        .accesses = {vk::read(weight), vk::read(grad_y), vk::write(grad_x)},
        .groups = groups,
        .work = work_of(desc),
    });
}

std::uint64_t conv2d_backward_weight_bytes(const vk::Recorder& recorder, const Conv2dDesc& desc) {
    if (desc.kernel == 1) return linear_backward_weight_bytes(recorder, linear_of(desc));
    return std::uint64_t{slices_of(desc)} * 9 * desc.out_channels * round_up(desc.in_channels, 4) *
           4;
}

Status conv2d_backward_weight(vk::Recorder& recorder, const Conv2dDesc& desc, const BufferView& x,
                              const BufferView& grad_y, const BufferView& grad_weight,
                              const BufferView& workspace, bool accumulate) {
    SPLAT_TRY(conv2d_check(desc));
    if (desc.kernel == 1)
        return linear_backward_weight(recorder, linear_of(desc), x, grad_y, grad_weight, workspace,
                                      accumulate);
    const std::uint32_t size = workgroup_size(recorder.device(), 64);
    const vk::Groups per_weight = groups_for(
        recorder.device(), std::uint64_t{9} * desc.in_channels * desc.out_channels, size);
    params::Conv2dParams params = params_of(desc);
    params.accumulate = accumulate ? 1 : 0;
    params.groups_x = per_weight[0];
    params.slices = slices_of(desc);
    SPLAT_TRY(recorder.dispatch({
        .op = "conv2d_backward_weight",
        .shader = "conv2d_backward_weight",
        .constants = {{kWorkgroupSizeId, size}},
        .push = params,
        .accesses = {vk::read(x), vk::read(grad_y), vk::write(workspace)},
        .groups = {per_weight[0], per_weight[1], params.slices},
        .work = work_of(desc),
    }));
    const double sums = 9.0 * params.slices * desc.in_channels * desc.out_channels;
    return recorder.dispatch({
        .op = "conv2d_backward_weight_reduce",
        .shader = "conv2d_backward_weight_reduce",
        .constants = {{kWorkgroupSizeId, size}},
        .push = params,
        .accesses = {vk::read(workspace), vk::read_write(grad_weight)},
        .groups = per_weight,
        .work = {.flops = sums, .bytes = 4 * sums},
    });
}

Status conv2d_backward_bias(vk::Recorder& recorder, const Conv2dDesc& desc,
                            const BufferView& grad_y, const BufferView& grad_bias,
                            bool accumulate) {
    SPLAT_TRY(conv2d_check(desc));
    return linear_backward_bias(recorder, linear_of(desc), grad_y, grad_bias, accumulate);
}

Status conv2d_backward_residual(vk::Recorder& recorder, const Conv2dDesc& desc,
                                const BufferView& grad_y, const BufferView& grad_residual) {
    SPLAT_TRY(conv2d_check(desc));
    const std::uint64_t quads = ceil_div(desc.out_channels, 4) * pixels_of(desc);
    const std::uint32_t size = workgroup_size(recorder.device(), 64);
    const vk::Groups groups = groups_for(recorder.device(), quads, size);
    params::Conv2dParams params = params_of(desc);
    params.groups_x = groups[0];
    return recorder.dispatch({
        .op = "conv2d_backward_residual",
        .shader = pick(recorder.kernels(), "conv2d_backward_residual",
                       "conv2d_backward_residual_cpu", "conv2d_backward_residual"),
        .constants = {{kWorkgroupSizeId, size}},
        .push = params,
        .accesses = {vk::read(grad_y), vk::write(grad_residual)},
        .groups = groups,
        .work = {.flops = 4.0 * static_cast<double>(quads),
                 .bytes = 32.0 * static_cast<double>(quads)},
    });
}

}  // namespace splat::ops

#include "ops/conv2d.h"

#include <algorithm>

#include "core/checked_math.h"
#include "core/shape.h"
#include "ops/conv2d_stages.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

using vk::BufferView;
using vk::Kernels;

/// A 1x1 convolution is a linear layer on the pixels.
LinearDesc linear_of(const Conv2dDesc& desc) {
    return {static_cast<std::uint32_t>(conv2d_pixels(desc)), desc.in_channels, desc.out_channels,
            desc.bias, desc.scale};
}

bool uses_winograd(const vk::Recorder& recorder, const Conv2dDesc& desc) {
    return recorder.kernels() != Kernels::kPlain && desc.winograd != 0;
}

}  // namespace

std::uint64_t conv2d_pixels(const Conv2dDesc& desc) {
    return std::uint64_t{desc.n} * desc.height * desc.width;
}

vk::Work conv2d_work(const Conv2dDesc& desc) {
    const auto pixels = static_cast<double>(conv2d_pixels(desc));
    const double weights = 9.0 * desc.in_channels * desc.out_channels;
    return {.flops = 2 * pixels * weights,
            .bytes = 4 * (pixels * desc.in_channels + pixels * desc.out_channels + weights)};
}

Conv2dDesc conv2d_transposed(const Conv2dDesc& desc) {
    Conv2dDesc transposed = desc;
    std::swap(transposed.in_channels, transposed.out_channels);
    transposed.bias = false;
    return transposed;
}

params::Conv2dParams conv2d_params(const Conv2dDesc& desc) {
    params::Conv2dParams params{};
    params.n = desc.n;
    params.in_channels = desc.in_channels;
    params.out_channels = desc.out_channels;
    params.height = desc.height;
    params.width = desc.width;
    params.has_bias = desc.bias ? 1 : 0;
    params.scale = desc.scale;
    params.slices = 1;
    return params;
}

Status conv2d_check(const Conv2dDesc& desc) {
    if (desc.kernel != 1 && desc.kernel != 3)
        return error(Code::kInvalidArgument, "conv2d: a kernel of %u x %u, expected 1 x 1 or 3 x 3",
                     desc.kernel, desc.kernel);
    if (desc.winograd != 0 && (desc.kernel != 3 || (desc.winograd != 2 && desc.winograd != 4)))
        return error(Code::kInvalidArgument,
                     "conv2d: winograd = %d with a kernel of %u x %u, expected 0, or 2 or 4 with a "
                     "kernel of 3 x 3",
                     desc.winograd, desc.kernel, desc.kernel);
    if (desc.in_channels > kMaxConv2dChannels || desc.out_channels > kMaxConv2dChannels)
        return error(Code::kUnsupported, "conv2d: %u -> %u channels, expected at most %u",
                     desc.in_channels, desc.out_channels, kMaxConv2dChannels);
    if (desc.width > kMaxConv2dWidth || desc.height > kMaxConv2dWidth)
        return error(Code::kUnsupported, "conv2d: images of %u x %u, expected at most %u x %u",
                     desc.height, desc.width, kMaxConv2dWidth, kMaxConv2dWidth);
    const std::uint64_t channels = round_up(std::max(desc.in_channels, desc.out_channels), 16);
    if (conv2d_pixels(desc) > kMaxElements / channels)
        return error(Code::kUnsupported,
                     "conv2d: %u images of %u x %u with %u -> %u channels: a tensor has 2^31 "
                     "elements or more",
                     desc.n, desc.height, desc.width, desc.in_channels, desc.out_channels);
    return {};
}

std::uint64_t conv2d_prepared_bytes(const vk::Recorder& recorder, const Conv2dDesc& desc,
                                    bool transposed) {
    if (desc.kernel == 1) return linear_packed_bytes(recorder, linear_of(desc), transposed);
    if (uses_winograd(recorder, desc)) return winograd_weight_bytes(desc);
    if (taps_fit(recorder, desc)) return taps_weight_bytes(recorder, desc, transposed);
    return direct_weight_bytes(recorder, transposed ? conv2d_transposed(desc) : desc);
}

Status conv2d_prepare_weight(vk::Recorder& recorder, const Conv2dDesc& desc,
                             const BufferView& weight, const BufferView& prepared,
                             bool transposed) {
    SPLAT_TRY(conv2d_check(desc));
    if (desc.kernel == 1)
        return linear_pack_weight(recorder, linear_of(desc), weight, prepared, transposed);
    if (uses_winograd(recorder, desc))
        return winograd_prepare_weight(recorder, desc, weight, prepared, transposed);
    if (taps_fit(recorder, desc))
        return taps_prepare_weight(recorder, desc, weight, prepared, transposed);
    return direct_prepare_weight(recorder, desc, weight, prepared, transposed);
}

std::uint64_t conv2d_forward_bytes(const vk::Recorder& recorder, const Conv2dDesc& desc) {
    if (uses_winograd(recorder, desc)) return winograd_forward_bytes(recorder, desc);
    return taps_fit(recorder, desc) ? taps_bytes(desc) : 0;
}

Status conv2d_forward(vk::Recorder& recorder, const Conv2dDesc& desc, const BufferView& x,
                      const BufferView& weight, const BufferView& bias, const BufferView& residual,
                      const BufferView& y, const BufferView& workspace) {
    SPLAT_TRY(conv2d_check(desc));
    if (desc.kernel == 1)
        return linear_forward(recorder, linear_of(desc), x, weight, bias, y, residual);
    if (uses_winograd(recorder, desc))
        return winograd_forward(recorder,
                                {"conv2d_forward_input", "conv2d_forward", "conv2d_forward_output"},
                                desc, x, weight, bias, residual, y, workspace);
    if (taps_fit(recorder, desc))
        return taps_forward(recorder, desc, x, weight, bias, residual, y, workspace);
    return direct_forward(recorder, "conv2d_forward", desc, x, weight, bias, residual, y);
}

std::uint64_t conv2d_backward_input_bytes(const vk::Recorder& recorder, const Conv2dDesc& desc) {
    if (uses_winograd(recorder, desc))
        return winograd_forward_bytes(recorder, conv2d_transposed(desc));
    return taps_fit(recorder, desc) ? taps_bytes(desc) : 0;
}

bool conv2d_adds(const vk::Recorder& recorder, const Conv2dDesc& desc) {
    if (recorder.kernels() == Kernels::kPlain) return false;
    return desc.scale == 1 || taps_fit(recorder, desc);  // others multiply the sum
}

Status conv2d_backward_begin(vk::Recorder& recorder, const Conv2dDesc& desc,
                             const BufferView& grad_y, const BufferView& workspace) {
    SPLAT_TRY(conv2d_check(desc));
    return taps_fit(recorder, desc) ? taps_spread(recorder, desc, grad_y, workspace) : Status();
}

Status conv2d_backward_input(vk::Recorder& recorder, const Conv2dDesc& desc,
                             const BufferView& weight, const BufferView& grad_y,
                             const BufferView& grad_x, const BufferView& workspace,
                             const BufferView& addend) {
    SPLAT_TRY(conv2d_check(desc));
    SPLAT_ASSERT(addend.block == nullptr || conv2d_adds(recorder, desc));
    if (desc.kernel == 1 && addend.block != nullptr)
        return linear_forward(recorder, linear_of(conv2d_transposed(desc)), grad_y, weight, weight,
                              grad_x, addend);
    if (desc.kernel == 1)
        return linear_backward_input(recorder, linear_of(desc), weight, grad_y, grad_x);
    if (uses_winograd(recorder, desc))
        return winograd_forward(recorder,
                                {"conv2d_backward_input_input", "conv2d_backward_input",
                                 "conv2d_backward_input_output"},
                                conv2d_transposed(desc), grad_y, weight, weight, addend, grad_x,
                                workspace);
    if (taps_fit(recorder, desc))
        return taps_backward_input(recorder, desc, weight, grad_x, workspace, addend);
    return direct_backward_input(recorder, desc, weight, grad_y, grad_x, addend);
}

std::uint64_t conv2d_backward_weight_bytes(const vk::Recorder& recorder, const Conv2dDesc& desc) {
    if (desc.kernel == 1) return linear_backward_weight_bytes(recorder, linear_of(desc));
    if (uses_winograd(recorder, desc)) return winograd_backward_weight_bytes(recorder, desc);
    if (taps_fit(recorder, desc)) return taps_backward_weight_bytes(recorder, desc);
    return direct_backward_weight_bytes(recorder, desc);
}

Status conv2d_backward_weight(vk::Recorder& recorder, const Conv2dDesc& desc, const BufferView& x,
                              const BufferView& grad_y, const BufferView& grad_weight,
                              const BufferView& workspace, bool accumulate) {
    SPLAT_TRY(conv2d_check(desc));
    if (desc.kernel == 1)
        return linear_backward_weight(recorder, linear_of(desc), x, grad_y, grad_weight, workspace,
                                      accumulate);
    if (uses_winograd(recorder, desc))
        return winograd_backward_weight(recorder, desc, x, grad_y, grad_weight, workspace,
                                        accumulate);
    if (taps_fit(recorder, desc))
        return taps_backward_weight(recorder, desc, x, grad_weight, workspace, accumulate);
    return direct_backward_weight(recorder, desc, x, grad_y, grad_weight, workspace, accumulate);
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
    const std::uint64_t quads = ceil_div(desc.out_channels, 4) * conv2d_pixels(desc);
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups groups = vk::groups_for(recorder.device(), quads, size);
    params::Conv2dParams params = conv2d_params(desc);
    params.groups_x = groups[0];
    return recorder.dispatch({
        .op = "conv2d_backward_residual",
        .shader = "conv2d_backward_residual",
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params,
        .accesses = {vk::read(grad_y), vk::write(grad_residual)},
        .groups = groups,
        .work = {.flops = 4.0 * static_cast<double>(quads),
                 .bytes = 32.0 * static_cast<double>(quads)},
    });
}

}  // namespace splat::ops

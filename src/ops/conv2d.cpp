#include "ops/conv2d.h"

#include <algorithm>

#include "core/checked_math.h"
#include "core/shape.h"
#include "ops/conv2d_algorithm.h"
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

/// Where the workspace of the weight's gradient begins in that of both: behind the input's where dispatches that do not
/// conflict run beside each other. What they share by taps is only read.
std::uint64_t weight_workspace(const vk::Recorder& recorder, const Conv2dDesc& desc) {
    if (!recorder.device().features.levels || !uses_winograd(recorder, desc)) return 0;
    return round_up(conv2d_backward_input_bytes(recorder, desc),
                    recorder.device().limits.offset_alignment);
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
    params.replicate = desc.replicate ? 1 : 0;
    return params;
}

Status conv2d_check(const Conv2dDesc& desc) {
    if (desc.kernel != 1 && desc.kernel != 3)
        return invalid("conv2d: a kernel of %u x %u, expected 1 x 1 or 3 x 3", desc.kernel,
                       desc.kernel);
    if (desc.winograd != 0 && (desc.kernel != 3 || (desc.winograd != 2 && desc.winograd != 4)))
        return invalid(
            "conv2d: winograd = %d with a kernel of %u x %u, expected 0, or 2 or 4 with a "
            "kernel of 3 x 3",
            desc.winograd, desc.kernel, desc.kernel);
    if (desc.replicate && desc.kernel != 3)
        return invalid(
            "conv2d: replicate with a kernel of %u x %u, which reads nothing beyond the image; "
            "expected a kernel of 3 x 3",
            desc.kernel, desc.kernel);
    if (desc.in_channels > kMaxConv2dChannels || desc.out_channels > kMaxConv2dChannels)
        return unsupported("conv2d: %u -> %u channels, expected at most %u", desc.in_channels,
                           desc.out_channels, kMaxConv2dChannels);
    if (desc.width > kMaxConv2dWidth || desc.height > kMaxConv2dWidth)
        return unsupported("conv2d: images of %u x %u, expected at most %u x %u", desc.height,
                           desc.width, kMaxConv2dWidth, kMaxConv2dWidth);
    const std::uint64_t channels = round_up(std::max(desc.in_channels, desc.out_channels), 16);
    if (conv2d_pixels(desc) > kMaxElements / channels)
        return unsupported(
            "conv2d: %u images of %u x %u with %u -> %u channels: a tensor has 2^31 "
            "elements or more",
            desc.n, desc.height, desc.width, desc.in_channels, desc.out_channels);
    return {};
}

std::uint64_t conv2d_prepared_bytes(const vk::Recorder& recorder, const Conv2dDesc& given,
                                    bool transposed) {
    const Conv2dDesc desc = transposed ? conv2d_widened(given) : given;
    if (desc.kernel == 1) return linear_packed_bytes(recorder, linear_of(desc), transposed);
    if (uses_winograd(recorder, desc)) return winograd_weight_bytes(desc);
    if (taps_fit(recorder, desc)) return taps_weight_bytes(recorder, desc, transposed);
    return direct_weight_bytes(recorder, transposed ? conv2d_transposed(desc) : desc);
}

Status conv2d_prepare_weight(vk::Recorder& recorder, const Conv2dDesc& given,
                             const BufferView& weight, const BufferView& prepared,
                             bool transposed) {
    SPLAT_TRY(conv2d_check(given));
    const Conv2dDesc desc = transposed ? conv2d_widened(given) : given;
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
    if (recorder.kernels() == Kernels::kPlain || desc.replicate) return false;
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

namespace {

constexpr Port kConv2dInputs[] = {{"x"},
                                  {"weight", Layout::kRowMajor},
                                  {"bias", Layout::kRowMajor, true},
                                  {"residual", Layout::kQuads, true}};
constexpr Attribute kConv2dAttributes[] = {
    {"scale", "number", "1", "factor of the output"},
    {"winograd", "integer", "0", "2 or 4: by F(2x2) or F(4x4), for kernels of 3x3; 0: directly"},
    {"precision", "integer", "0",
     "1 strict, 2 balanced, 3 fast: winograd by the table for the shape; 0: as winograd says"},
    {"replicate", "boolean", "false", "beyond x is its nearest pixel instead of 0"},
};

Status check_attributes(const Attributes& attributes) {
    const std::int64_t precision = attributes.integer("precision");
    const std::int64_t winograd = attributes.integer("winograd");
    if (precision < 0 || precision > 3)
        return invalid("conv2d: precision = %lld, expected 0 to 3", lld(precision));
    if (precision > 0 && winograd != 0)
        return invalid(
            "conv2d: winograd = %lld with precision = %lld, which chooses it; expected "
            "one of them",
            lld(winograd), lld(precision));
    return {};
}

/// Winograd's tile becomes smaller where a device cannot bind its weights: 36 / 9 of those of the convolution.
Conv2dDesc conv2d_desc(const vk::Recorder& recorder, const Attributes& attributes, const Shape& x,
                       const Shape& weight, bool bias) {
    Conv2dDesc desc{.n = x[0],
                    .in_channels = x[1],
                    .height = x[2],
                    .width = x[3],
                    .out_channels = weight[0],
                    .kernel = weight[2],
                    .bias = bias,
                    .scale = static_cast<float>(attributes.number("scale")),
                    .winograd = static_cast<std::int32_t>(
                        std::clamp<std::int64_t>(attributes.integer("winograd"), -1, 99))};
    desc.replicate = attributes.boolean("replicate");
    const std::int64_t precision = attributes.integer("precision");
    if (precision > 0 && desc.kernel == 3)
        desc.winograd = conv2d_algorithm(desc, static_cast<Conv2dPrecision>(precision - 1));
    const std::uint64_t most = recorder.device().limits.max_storage_buffer_bytes;
    while (desc.winograd > 0 && winograd_weight_bytes(desc) > most) desc.winograd -= 2;
    return desc;
}

Conv2dDesc conv2d_desc(const vk::Recorder& recorder, const Attributes& attributes,
                       const OpViews& v) {
    return conv2d_desc(recorder, attributes, v.inputs[0].shape, v.inputs[1].shape,
                       present(v.inputs[2]));
}

Result<OpPlan> conv2d_plan(const vk::Recorder& recorder, const Attributes& attributes,
                           std::span<const Shape> inputs) {
    const Shape& x = inputs[0];
    const Shape& weight = inputs[1];
    SPLAT_TRY(check_attributes(attributes));
    SPLAT_TRY(expect_images("conv2d", "x", x));
    if (weight.rank() != 4)
        return error(Code::kShape, "conv2d: tensor 'weight' has shape %s, expected [K, C, R, R]",
                     weight.text().c_str());
    SPLAT_TRY(expect_shape("conv2d", "weight", weight, {weight[0], x[1], weight[2], weight[2]}));
    const bool bias = inputs[2].rank() > 0;
    if (bias) SPLAT_TRY(expect_shape("conv2d", "bias", inputs[2], {weight[0]}));
    const Shape y{x[0], weight[0], x[2], x[3]};
    if (inputs[3].rank() > 0) SPLAT_TRY(expect_shape("conv2d", "residual", inputs[3], y));
    const Conv2dDesc desc = conv2d_desc(recorder, attributes, x, weight, bias);
    SPLAT_TRY(conv2d_check(desc));
    SPLAT_TRY(conv2d_check(conv2d_widened(desc)));
    const std::uint64_t for_input = conv2d_backward_input_bytes(recorder, desc),
                        for_weight = conv2d_backward_weight_bytes(recorder, desc);
    const std::uint64_t both = std::max(for_input, weight_workspace(recorder, desc) + for_weight);
    return OpPlan{
        .outputs = {y},
        .forward_workspace = conv2d_forward_bytes(recorder, desc),
        .backward_workspace = desc.replicate ? replicate_backward_bytes(recorder, desc) : both,
        .backward_least = desc.replicate ? 0 : std::max(for_input, for_weight),
        .forward_prepared = conv2d_prepared_bytes(recorder, desc, false),
        .backward_prepared = conv2d_prepared_bytes(recorder, desc, true),
        .adds = conv2d_adds(recorder, desc),
        .passes = desc.scale == 1 ? 1U << 3 : 0};
}

Status conv2d_row_prepare(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v,
                          Pass pass) {
    const bool transposed = pass == Pass::kBackward;
    return conv2d_prepare_weight(recorder, conv2d_desc(recorder, attributes, v), v.inputs[1],
                                 transposed ? v.backward_prepared : v.forward_prepared, transposed);
}

Status conv2d_row_forward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    const Conv2dDesc desc = conv2d_desc(recorder, attributes, v);
    const BufferView& weight = present(v.forward_prepared) ? v.forward_prepared : v.inputs[1];
    return conv2d_forward(recorder, desc, v.inputs[0], weight,
                          desc.bias ? v.inputs[2] : v.inputs[1], v.inputs[3], v.outputs[0],
                          v.workspace);
}

Status conv2d_row_backward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    const Conv2dDesc desc = conv2d_desc(recorder, attributes, v);
    const BufferView& weight = present(v.backward_prepared) ? v.backward_prepared : v.inputs[1];
    const BufferView& grad_y = v.grad_outputs[0];
    const bool input = present(v.grad_inputs[0]), of_weight = present(v.grad_inputs[1]);
    if (desc.replicate) {
        if (input || of_weight) SPLAT_TRY(replicate_backward(recorder, desc, weight, v));
    } else {
        if (input || of_weight)
            SPLAT_TRY(conv2d_backward_begin(recorder, desc, grad_y, v.workspace));
        if (input)
            SPLAT_TRY(conv2d_backward_input(recorder, desc, weight, grad_y, v.grad_inputs[0],
                                            v.workspace, v.addend));
        if (of_weight) {
            const std::uint64_t bytes = conv2d_backward_weight_bytes(recorder, desc);
            const std::uint64_t behind = weight_workspace(recorder, desc);
            const BufferView workspace =
                v.workspace.part(v.workspace.bytes < behind + bytes ? 0 : behind, bytes);
            SPLAT_TRY(conv2d_backward_weight(recorder, desc, v.inputs[0], grad_y, v.grad_inputs[1],
                                             workspace, v.accumulate));
        }
    }
    if (present(v.grad_inputs[2]))
        SPLAT_TRY(conv2d_backward_bias(recorder, desc, grad_y, v.grad_inputs[2], v.accumulate));
    if (!present(v.grad_inputs[3])) return {};
    return conv2d_backward_residual(recorder, desc, grad_y, v.grad_inputs[3]);
}

}  // namespace

const OpRow kConv2dRow = {
    .name = "conv2d",
    .equation =
        "y = (conv(x, weight) + bias + residual) * scale, stride 1, padded to the same size",
    .inputs = kConv2dInputs,
    .outputs = kOutputY,
    .attributes = kConv2dAttributes,
    .plan = conv2d_plan,
    .prepare = conv2d_row_prepare,
    .forward = conv2d_row_forward,
    .backward = conv2d_row_backward,
    .backward_reads = product_backward_reads};

}  // namespace splat::ops

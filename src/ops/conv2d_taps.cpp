#include "core/checked_math.h"
#include "ops/conv2d_stages.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

using vk::BufferView;

constexpr std::uint64_t kStep = 256;  ///< bytes; suits every alignment of bindings
/// Few channels leave tiles of the direct kernels empty; with many the products of all taps cost memory.
constexpr std::uint32_t kMostChannels = 16;
constexpr std::uint64_t kMostBytes = std::uint64_t{64} << 20;

std::uint64_t rows_of(const Conv2dDesc& desc) {
    return 9 * round_up(desc.out_channels, 4);
}

/// All taps of all output channels, for each pixel separately.
LinearDesc product_of(const Conv2dDesc& desc) {
    return {static_cast<std::uint32_t>(conv2d_pixels(desc)), desc.in_channels,
            static_cast<std::uint32_t>(rows_of(desc)), false, 1};
}

std::uint64_t matrix_bytes(const Conv2dDesc& desc) {
    return round_up(rows_of(desc) * desc.in_channels * 4, kStep);
}

/// Record one of the passes over all products, pixels or weights.
Status rearrange(vk::Recorder& recorder, const char* op, const char* shader,
                 params::Conv2dParams params, std::uint64_t count,
                 std::vector<vk::Access> accesses) {
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups groups = vk::groups_for(recorder.device(), count, size);
    params.groups_x = groups[0];
    double bytes = 0;
    for (const vk::Access& access : accesses) bytes += static_cast<double>(access.view.bytes);
    return recorder.dispatch({
        .op = op,
        .shader = shader,
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params,
        .accesses = std::move(accesses),
        .groups = groups,
        .work = {.flops = 0, .bytes = bytes},
    });
}

}  // namespace

bool taps_fit(const vk::Recorder& recorder, const Conv2dDesc& desc) {
    return recorder.kernels() != vk::Kernels::kPlain && desc.kernel == 3 && desc.winograd == 0 &&
           !desc.replicate && desc.out_channels <= kMostChannels && taps_bytes(desc) <= kMostBytes;
}

std::uint64_t taps_bytes(const Conv2dDesc& desc) {
    return round_up(4 * rows_of(desc) * conv2d_pixels(desc), kStep);
}

std::uint64_t taps_weight_bytes(const vk::Recorder& recorder, const Conv2dDesc& desc,
                                bool transposed) {
    return matrix_bytes(desc) + linear_packed_bytes(recorder, product_of(desc), transposed);
}

Status taps_prepare_weight(vk::Recorder& recorder, const Conv2dDesc& desc, const BufferView& weight,
                           const BufferView& prepared, bool transposed) {
    const LinearDesc product = product_of(desc);
    const std::uint64_t elements = rows_of(desc) * desc.in_channels;
    const BufferView matrix = prepared.part(0, matrix_bytes(desc));
    SPLAT_TRY(rearrange(recorder, "conv2d_pack_weight", "conv2d_taps_forward_weight",
                        conv2d_params(desc), elements, {vk::read(weight), vk::write(matrix)}));
    return linear_pack_weight(
        recorder, product, matrix,
        prepared.part(matrix.bytes, linear_packed_bytes(recorder, product, transposed)),
        transposed);
}

Status taps_forward(vk::Recorder& recorder, const Conv2dDesc& desc, const BufferView& x,
                    const BufferView& weight, const BufferView& bias, const BufferView& residual,
                    const BufferView& y, const BufferView& workspace) {
    const LinearDesc product = product_of(desc);
    const BufferView packed =
        weight.part(matrix_bytes(desc), linear_packed_bytes(recorder, product, false));
    const BufferView products = workspace.part(0, taps_bytes(desc));
    SPLAT_TRY(linear_forward(recorder, product, x, packed, packed, products));
    params::Conv2dParams params = conv2d_params(desc);
    params.has_residual = residual.block != nullptr ? 1 : 0;
    return rearrange(recorder, "conv2d_forward", "conv2d_taps_forward_sum", params,
                     ceil_div(desc.out_channels, 4) * conv2d_pixels(desc),
                     {vk::read(products), vk::read(bias),
                      vk::read(params.has_residual != 0 ? residual : products), vk::write(y)});
}

Status taps_spread(vk::Recorder& recorder, const Conv2dDesc& desc, const BufferView& grad_y,
                   const BufferView& workspace) {
    return rearrange(recorder, "conv2d_backward_begin", "conv2d_taps_backward_spread",
                     conv2d_params(desc), rows_of(desc) / 4 * conv2d_pixels(desc),
                     {vk::read(grad_y), vk::write(workspace.part(0, taps_bytes(desc)))});
}

Status taps_backward_input(vk::Recorder& recorder, const Conv2dDesc& desc, const BufferView& weight,
                           const BufferView& grad_x, const BufferView& workspace,
                           const BufferView& addend) {
    const LinearDesc product = product_of(desc);
    const BufferView packed =
        weight.part(matrix_bytes(desc), linear_packed_bytes(recorder, product, true));
    const LinearDesc transposed{product.rows, product.out_features, product.in_features, false, 1};
    return linear_forward(recorder, transposed, workspace.part(0, taps_bytes(desc)), packed, packed,
                          grad_x, addend);
}

std::uint64_t taps_backward_weight_bytes(const vk::Recorder& recorder, const Conv2dDesc& desc) {
    return taps_bytes(desc) + matrix_bytes(desc) +
           linear_backward_weight_bytes(recorder, product_of(desc));
}

Status taps_backward_weight(vk::Recorder& recorder, const Conv2dDesc& desc, const BufferView& x,
                            const BufferView& grad_weight, const BufferView& workspace,
                            bool accumulate) {
    const LinearDesc product = product_of(desc);
    const BufferView spread = workspace.part(0, taps_bytes(desc));
    const BufferView matrix = workspace.part(spread.bytes, matrix_bytes(desc));
    const BufferView partial = workspace.part(spread.bytes + matrix.bytes,
                                              linear_backward_weight_bytes(recorder, product));
    SPLAT_TRY(linear_backward_weight(recorder, product, x, spread, matrix, partial, false));
    params::Conv2dParams params = conv2d_params(desc);
    params.accumulate = accumulate ? 1 : 0;
    return rearrange(recorder, "conv2d_backward_weight_reduce", "conv2d_taps_backward_weight",
                     params, std::uint64_t{9} * desc.in_channels * desc.out_channels,
                     {vk::read(matrix), vk::read_write(grad_weight)});
}

}  // namespace splat::ops

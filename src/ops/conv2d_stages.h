#pragma once

#include "ops/conv2d.h"
#include "params/conv2d_params.h"

/// The algorithms that conv2d.cpp chooses from, for kernels of 3 x 3. Arguments as in conv2d.h.
namespace splat::ops {

std::uint64_t conv2d_pixels(const Conv2dDesc& desc);

/// Flops of the definition, whichever algorithm computes it, and bytes of the operands.
vk::Work conv2d_work(const Conv2dDesc& desc);

/// The gradient of the input as a convolution: channels swapped, no bias.
Conv2dDesc conv2d_transposed(const Conv2dDesc& desc);

params::Conv2dParams conv2d_params(const Conv2dDesc& desc);

/// The convolution that computes the gradients: with a replicated border that of images which have the border, as
/// pad2d makes them, with zeros around the gradient of y.
Conv2dDesc conv2d_widened(const Conv2dDesc& desc);
std::uint64_t replicate_backward_bytes(const vk::Recorder& recorder, const Conv2dDesc& desc);
/// Gradients of x and the weight, those that `v` asks for. `v.workspace` has replicate_backward_bytes.
Status replicate_backward(vk::Recorder& recorder, const Conv2dDesc& desc,
                          const vk::BufferView& weight, const OpViews& v);

/// By the definition: the plain kernels, and register tiles of their fast twins.
std::uint64_t direct_weight_bytes(const vk::Recorder& recorder, const Conv2dDesc& desc);
Status direct_prepare_weight(vk::Recorder& recorder, const Conv2dDesc& desc,
                             const vk::BufferView& weight, const vk::BufferView& prepared,
                             bool transposed);
Status direct_forward(vk::Recorder& recorder, const char* op, const Conv2dDesc& desc,
                      const vk::BufferView& x, const vk::BufferView& weight,
                      const vk::BufferView& bias, const vk::BufferView& residual,
                      const vk::BufferView& y);
Status direct_backward_input(vk::Recorder& recorder, const Conv2dDesc& desc,
                             const vk::BufferView& weight, const vk::BufferView& grad_y,
                             const vk::BufferView& grad_x, const vk::BufferView& addend);
std::uint64_t direct_backward_weight_bytes(const vk::Recorder& recorder, const Conv2dDesc& desc);
Status direct_backward_weight(vk::Recorder& recorder, const Conv2dDesc& desc,
                              const vk::BufferView& x, const vk::BufferView& grad_y,
                              const vk::BufferView& grad_weight, const vk::BufferView& workspace,
                              bool accumulate);

/// By taps, for few output channels, which leave tiles of the direct kernels half empty: one matrix product
/// computes all nine products of every pixel, [9][K/4][N*H*W] quads, which a pass shifts and sums. The
/// gradients multiply the matrix of grad_y shifted by each tap (taps_spread).
///
/// workspace    taps_bytes; taps_backward_weight_bytes, with the result of taps_spread
/// weight       taps_weight_bytes: the matrix, followed by its packed form of ops/linear.h
/// addend       [N,C,H,W] as quads, added to grad_x, or an empty view
bool taps_fit(const vk::Recorder& recorder, const Conv2dDesc& desc);
std::uint64_t taps_bytes(const Conv2dDesc& desc);
std::uint64_t taps_weight_bytes(const vk::Recorder& recorder, const Conv2dDesc& desc,
                                bool transposed);
Status taps_prepare_weight(vk::Recorder& recorder, const Conv2dDesc& desc,
                           const vk::BufferView& weight, const vk::BufferView& prepared,
                           bool transposed);
Status taps_forward(vk::Recorder& recorder, const Conv2dDesc& desc, const vk::BufferView& x,
                    const vk::BufferView& weight, const vk::BufferView& bias,
                    const vk::BufferView& residual, const vk::BufferView& y,
                    const vk::BufferView& workspace);
Status taps_spread(vk::Recorder& recorder, const Conv2dDesc& desc, const vk::BufferView& grad_y,
                   const vk::BufferView& workspace);
Status taps_backward_input(vk::Recorder& recorder, const Conv2dDesc& desc,
                           const vk::BufferView& weight, const vk::BufferView& grad_x,
                           const vk::BufferView& workspace, const vk::BufferView& addend);
std::uint64_t taps_backward_weight_bytes(const vk::Recorder& recorder, const Conv2dDesc& desc);
Status taps_backward_weight(vk::Recorder& recorder, const Conv2dDesc& desc, const vk::BufferView& x,
                            const vk::BufferView& grad_weight, const vk::BufferView& workspace,
                            bool accumulate);

/// Winograd's F(2x2, 3x3) and F(4x4, 3x3), desc.winograd = 2 or 4: transform all tiles of a slice, multiply
/// matrices for each place of a tile, transform back. Slices of tiles use the same workspace, so that it
/// stays in the cache and within one binding.
///
/// Precision    the transforms cancel: 3e-7 for F(2x2), 1e-6 for F(4x4), 4e-6 for its gradient of a weight over
///              many tiles, relative L2
/// Source       A. Lavin, S. Gray, Fast Algorithms for Convolutional Neural Networks, 2016
std::uint64_t winograd_weight_bytes(const Conv2dDesc& desc);
Status winograd_prepare_weight(vk::Recorder& recorder, const Conv2dDesc& desc,
                               const vk::BufferView& weight, const vk::BufferView& prepared,
                               bool transposed);

/// Workspace of winograd_forward; the same for desc and its transpose.
std::uint64_t winograd_forward_bytes(const vk::Recorder& recorder, const Conv2dDesc& desc);

/// `op` labels the dispatches. Errors: kUnsupported if the weight exceeds one binding.
struct WinogradLabels {
    const char* input;
    const char* product;
    const char* output;
};
Status winograd_forward(vk::Recorder& recorder, const WinogradLabels& labels,
                        const Conv2dDesc& desc, const vk::BufferView& x,
                        const vk::BufferView& weight, const vk::BufferView& bias,
                        const vk::BufferView& residual, const vk::BufferView& y,
                        const vk::BufferView& workspace);
std::uint64_t winograd_backward_weight_bytes(const vk::Recorder& recorder, const Conv2dDesc& desc);
Status winograd_backward_weight(vk::Recorder& recorder, const Conv2dDesc& desc,
                                const vk::BufferView& x, const vk::BufferView& grad_y,
                                const vk::BufferView& grad_weight, const vk::BufferView& workspace,
                                bool accumulate);

}  // namespace splat::ops

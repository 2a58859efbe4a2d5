#pragma once

#include "ops/linear.h"
#include "ops/op_table.h"
#include "vk/recorder.h"

namespace splat::ops {

/// A convolution of stride 1, padded with kernel / 2 pixels on each side: y is as large as x.
struct Conv2dDesc {
    std::uint32_t n = 1;
    std::uint32_t in_channels = 1;
    std::uint32_t height = 1;
    std::uint32_t width = 1;
    std::uint32_t out_channels = 1;
    std::uint32_t kernel = 3;  ///< 1 or 3
    bool bias = true;
    float scale = 1;            ///< factor of the output
    std::int32_t winograd = 0;  ///< 2 or 4: F(2x2) or F(4x4), for 3 x 3; plain kernels ignore it
    bool replicate = false;     ///< beyond the image is its nearest pixel instead of 0, for 3 x 3
};

/// Errors: kInvalidArgument for other kernels, tiles or borders, kUnsupported if an operand has 2^31 elements or more,
/// channels exceed kMaxConv2dChannels or an image is wider than kMaxConv2dWidth.
Status conv2d_check(const Conv2dDesc& desc);
inline constexpr std::uint32_t kMaxConv2dChannels = 4096;  ///< 9 turns for each, see kMaxTurns
inline constexpr std::uint32_t kMaxConv2dWidth = 16384;    ///< one turn for each, see kMaxTurns

/// Bytes of the weight in the form that the kernels in use read; 0 if they read the weight itself.
std::uint64_t conv2d_prepared_bytes(const vk::Recorder& recorder, const Conv2dDesc& desc,
                                    bool transposed);

/// Reorder a weight for the kernels in use, to be done once per change of the weight. Records
/// nothing if conv2d_prepared_bytes is 0.
///
/// weight       [K,C,R,R] float32, row-major
/// prepared     conv2d_prepared_bytes(transposed)
/// transposed   false: for conv2d_forward; true: for conv2d_backward_input
/// Errors       those of conv2d_check
/// Precision    exact
/// Determinism  bit-exact for any thread count
Status conv2d_prepare_weight(vk::Recorder& recorder, const Conv2dDesc& desc,
                             const vk::BufferView& weight, const vk::BufferView& prepared,
                             bool transposed);

/// Bytes of `workspace` of conv2d_forward; 0 if none is needed.
std::uint64_t conv2d_forward_bytes(const vk::Recorder& recorder, const Conv2dDesc& desc);

/// Cross-correlation:
///   y[n,k,p] = (sum_{c,r,s} weight[k,c,r,s] x[n,c,p+(r,s)-R/2] + bias[k] + residual[n,k,p]) * scale
/// where x is 0 beyond the image or, if desc.replicate, its nearest pixel.
///
/// x            [N,C,H,W] float32 as quads
/// weight       prepared with transposed = false; the weight itself if conv2d_prepared_bytes is 0
/// bias         [K]; any view of 16 bytes or more, unread, if desc.bias is false
/// residual     [N,K,H,W] as quads, or an empty view for none
/// y            [N,K,H,W] as quads; no aliasing
/// workspace    conv2d_forward_bytes
/// Errors       those of conv2d_check; nothing is recorded on error
/// Precision    relative L2 2e-6, of grad_weight with winograd = 4 5e-6 (tests/ops/conv2d_test.cpp)
/// Determinism  bit-exact for any thread count
/// Source       the definition; 1x1 is the linear layer of ops/linear.h with N * H * W rows
Status conv2d_forward(vk::Recorder& recorder, const Conv2dDesc& desc, const vk::BufferView& x,
                      const vk::BufferView& weight, const vk::BufferView& bias,
                      const vk::BufferView& residual, const vk::BufferView& y,
                      const vk::BufferView& workspace);

/// Bytes of the `workspace` that conv2d_backward_input and conv2d_backward_weight share; 0 if none is
/// needed.
std::uint64_t conv2d_backward_input_bytes(const vk::Recorder& recorder, const Conv2dDesc& desc);
std::uint64_t conv2d_backward_weight_bytes(const vk::Recorder& recorder, const Conv2dDesc& desc);

/// True if conv2d_backward_input takes an addend.
bool conv2d_adds(const vk::Recorder& recorder, const Conv2dDesc& desc);

/// Compute the part that the gradients of the input and the weight share into the workspace; record it
/// before them.
Status conv2d_backward_begin(vk::Recorder& recorder, const Conv2dDesc& desc,
                             const vk::BufferView& grad_y, const vk::BufferView& workspace);

/// The gradients, each times scale, for a border of zeros; kConv2dRow has those of a replicated one, too:
///   grad_x[n,c,p] = sum_{k,r,s} weight[k,c,r,s] grad_y[n,k,p-(r,s)+R/2]
///   grad_weight[k,c,r,s] = sum_{n,p} grad_y[n,k,p] x[n,c,p+(r,s)-R/2]
///   grad_bias[k] = sum_{n,p} grad_y[n,k,p],  grad_residual = grad_y
///
/// weight       prepared with transposed = true; the weight itself if conv2d_prepared_bytes is 0
/// x, grad_x    [N,C,H,W], grad_y, grad_residual [N,K,H,W], as quads; overwritten; no aliasing
/// grad_weight  [K,C,R,R] row-major; grad_bias [K]: overwritten, or added to when `accumulate`
/// addend       [N,C,H,W] as quads, added to grad_x; an empty view for none, or if not conv2d_adds
/// workspace    conv2d_backward_input_bytes, conv2d_backward_weight_bytes
/// Errors       as the forward pass
/// Precision    as the forward pass
/// Determinism  bit-exact for any thread count
/// Source       derived in tests/ref/conv2d_ref.h
Status conv2d_backward_input(vk::Recorder& recorder, const Conv2dDesc& desc,
                             const vk::BufferView& weight, const vk::BufferView& grad_y,
                             const vk::BufferView& grad_x, const vk::BufferView& workspace,
                             const vk::BufferView& addend = {});
Status conv2d_backward_weight(vk::Recorder& recorder, const Conv2dDesc& desc,
                              const vk::BufferView& x, const vk::BufferView& grad_y,
                              const vk::BufferView& grad_weight, const vk::BufferView& workspace,
                              bool accumulate);
Status conv2d_backward_bias(vk::Recorder& recorder, const Conv2dDesc& desc,
                            const vk::BufferView& grad_y, const vk::BufferView& grad_bias,
                            bool accumulate);
Status conv2d_backward_residual(vk::Recorder& recorder, const Conv2dDesc& desc,
                                const vk::BufferView& grad_y, const vk::BufferView& grad_residual);

extern const OpRow kConv2dRow;

}  // namespace splat::ops

#pragma once

#include "ops/op_table.h"

namespace splat::ops {

/// `rows` are the columns of the quad layout: n for [n, features], n * h * w for a 1x1 convolution.
struct LinearDesc {
    std::uint32_t rows = 1;
    std::uint32_t in_features = 1;
    std::uint32_t out_features = 1;
    bool bias = true;
    float scale = 1;  ///< factor of the output
};

/// Errors: kUnsupported if a product of two extents reaches 2^31, or on CPU devices features exceed 65000.
Status linear_check(const vk::DeviceInfo& device, const LinearDesc& desc);

/// Bytes of the packed weight of linear_pack_weight; 0 if the kernels in use read the weight itself.
std::uint64_t linear_packed_bytes(const vk::Recorder& recorder, const LinearDesc& desc,
                                  bool transposed);

/// Reorder a weight for the kernels in use, to be done once per change of the weight. Records
/// nothing if linear_packed_bytes is 0.
///
/// weight       [out,in] float32, row-major
/// packed       linear_packed_bytes(transposed)
/// transposed   false: for linear_forward; true: for linear_backward_input
/// Errors       those of linear_check
/// Precision    exact
/// Determinism  bit-exact for any thread count
/// Source       shaders/ops/linear_pack_weight.comp
Status linear_pack_weight(vk::Recorder& recorder, const LinearDesc& desc,
                          const vk::BufferView& weight, const vk::BufferView& packed,
                          bool transposed);

/// Affine map of every row:  y[r,o] = (sum_k weight[o,k] x[r,k] + bias[o] + residual[r,o]) * scale
///
/// x, y         [rows,in] and [rows,out] float32 as quads; no aliasing
/// weight       packed by linear_pack_weight(transposed = false); the weight itself where
///              linear_packed_bytes is 0
/// bias         [out]; any view of 16 bytes or more, unread, if desc.bias is false
/// residual     [rows,out] as quads, or an empty view for none
/// Errors       those of linear_check; nothing is recorded on error
/// Precision    relative L2 2e-6 for in <= 9216 (tests/ops/linear_test.cpp)
/// Determinism  bit-exact for any thread count
/// Source       the definition; register tiles: BENCHMARKS.md
Status linear_forward(vk::Recorder& recorder, const LinearDesc& desc, const vk::BufferView& x,
                      const vk::BufferView& weight, const vk::BufferView& bias,
                      const vk::BufferView& y, const vk::BufferView& residual = {});

/// Bytes of `partial` of linear_backward_weight.
std::uint64_t linear_backward_weight_bytes(const vk::Recorder& recorder, const LinearDesc& desc);

/// The gradients, each times scale:  grad_x = grad_y W,  grad_weight = grad_y^T x,
/// grad_bias = sum_r grad_y
///
/// weight       packed by linear_pack_weight(transposed = true); the weight itself where
///              linear_packed_bytes is 0
/// grad_y       [rows,out] as quads;  grad_x [rows,in] as quads, overwritten
/// grad_weight  [out,in] row-major; grad_bias [out]: overwritten, or added to when `accumulate`
/// partial      workspace of linear_backward_weight_bytes
/// Errors       as the forward pass
/// Precision    as the forward pass for out <= 9216 and any number of rows up to 2^20
/// Determinism  bit-exact for any thread count
/// Source       derived in tests/ref/linear_ref.h
Status linear_backward_input(vk::Recorder& recorder, const LinearDesc& desc,
                             const vk::BufferView& weight, const vk::BufferView& grad_y,
                             const vk::BufferView& grad_x);
Status linear_backward_weight(vk::Recorder& recorder, const LinearDesc& desc,
                              const vk::BufferView& x, const vk::BufferView& grad_y,
                              const vk::BufferView& grad_weight, const vk::BufferView& partial,
                              bool accumulate);
Status linear_backward_bias(vk::Recorder& recorder, const LinearDesc& desc,
                            const vk::BufferView& grad_y, const vk::BufferView& grad_bias,
                            bool accumulate);

extern const OpRow kLinearRow;

}  // namespace splat::ops

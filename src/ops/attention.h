#pragma once

#include "ops/op_table.h"
#include "ops/quads.h"

namespace splat::ops {

struct AttentionDesc {
    std::uint32_t n = 1;
    std::uint32_t c = 1;
    std::uint32_t heads = 1;    ///< heads of c / heads neighbouring channels each
    std::uint32_t queries = 1;  ///< pixels of q
    std::uint32_t keys = 1;     ///< pixels of k and v
};

/// Errors: kShape if the heads do not divide the channels into whole quads (one head may have any
/// channels); kUnsupported for 2^31 weights at a time, more than 65536 queries, keys or channels per head, or
/// beyond the device's group counts.
Status attention_check(const vk::Recorder& recorder, const AttentionDesc& desc);

/// Queries of one image that are computed at a time, or 0 if the weights of all images are kept for backward. They are
/// kept while those of an image fit in DeviceLimits::slice_bytes, since computing them again adds a fifth product to
/// the four of the backward pass. Beyond that nothing is saved, and workspaces hold the weights of a block, backward
/// three times: at most that limit, on GPUs 8 times as much, unless 16 queries need more. The choice does not depend
/// on the number of images, whose results would otherwise have other bits in a larger batch.
std::uint32_t attention_block(const vk::Recorder& recorder, const AttentionDesc& desc);

/// [n * heads, ceil(keys / 4), queries, 4]: the softmax of every query, if it is kept.
Shape attention_weights_shape(const AttentionDesc& desc);

/// Bytes of `workspace`.
std::uint64_t attention_forward_bytes(const vk::Recorder& recorder, const AttentionDesc& desc);
std::uint64_t attention_backward_bytes(const vk::Recorder& recorder, const AttentionDesc& desc);

/// Dot-product attention of each image and head:
///
///   w[l,j] = softmax_j( sum_c q[c,l] k[c,j] / sqrt(c / heads) )      y[c,l] = sum_j w[l,j] v[c,j]
///
/// q, y         [N,C,queries] float32 as quads
/// k, v         [N,C,keys] as quads; no aliasing
/// weights      out, saved for backward; without a buffer if attention_block() is not 0
/// Errors       those of attention_check; nothing is recorded on error
/// Precision    relative L2 2e-6 (tests/ops/attention_test.cpp)
/// Determinism  bit-exact for any thread count
/// Source       Vaswani et al. 2017, arXiv:1706.03762, eq. 1; register tiles: ops/linear.h
Status attention_forward(vk::Recorder& recorder, const AttentionDesc& desc, const vk::BufferView& q,
                         const vk::BufferView& k, const vk::BufferView& v, const vk::BufferView& y,
                         const vk::BufferView& weights, const vk::BufferView& workspace);

/// The gradients. Those without a buffer are not computed.
///
///   grad_v = grad_y w                          grad_w = v^T grad_y
///   grad_s = w (grad_w - sum_j w grad_w) / sqrt(c / heads)
///   grad_q = k grad_s^T                        grad_k = q grad_s
///
/// grad_q, grad_k, grad_v  as q, k, v; overwritten
/// Errors, Determinism     as the forward pass
/// Precision               relative L2 4e-6
/// Source                  derived in tests/ref/attention_ref.h
struct AttentionGradients {
    vk::BufferView q;
    vk::BufferView k;
    vk::BufferView v;
};
Status attention_backward(vk::Recorder& recorder, const AttentionDesc& desc,
                          const vk::BufferView& q, const vk::BufferView& k, const vk::BufferView& v,
                          const vk::BufferView& weights, const vk::BufferView& grad_y,
                          const AttentionGradients& gradients, const vk::BufferView& workspace);

extern const OpRow kAttentionRow;

}  // namespace splat::ops

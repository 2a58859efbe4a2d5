#pragma once

#include "ops/op_table.h"
#include "ops/quads.h"

namespace splat::ops {

struct GroupNormDesc {
    QuadDims x;
    std::uint32_t groups = 1;
    float eps = 1e-6F;
    bool silu = false;
};

/// Errors: kShape if C % groups != 0, kInvalidArgument for eps <= 0 or not finite, kUnsupported
/// beyond the device's group counts and for groups of more elements or channels than its loops can walk.
Status group_norm_check(const vk::DeviceInfo& device, const GroupNormDesc& desc);

/// Bytes of `sums` in the backward pass: [N,C] pairs.
std::uint64_t group_norm_sums_bytes(const GroupNormDesc& desc);

/// Group normalisation over the C/G channels and all pixels of each group, optionally followed by
/// SiLU in the same pass.
///
///   t = gamma[c] * (x - mean[n,g]) * rstd[n,g] + beta[c]      rstd = 1/sqrt(var + eps), var biased
///   y = silu ? t * sigmoid(t) : t
///
/// x, y         [N,C,H,W] float32 as quads; y may be x
/// gamma, beta  [C]
/// mean         [2,N,G]    out, saved for backward: the rounded means, then what the rounding lost
/// rstd         [N,G]      out, saved for backward
/// eps          > 0, same unit as var(x)
/// Errors       those of group_norm_check; nothing is recorded on error
/// Precision    y and the gradients within 1e-6 for |mean|/std <= 1e3, 1e-5 for 1e4; constant input gives
///              t = beta exactly; squares may overflow, x - mean may not
///              (tests/ops/group_norm_test.cpp)
/// Determinism  bit-exact for any thread count
/// Source       Wu & He 2018, arXiv:1803.08494, eq. 1-3; SiLU: Elfwing et al. 2017,
///              arXiv:1702.03118
Status group_norm_forward(vk::Recorder& recorder, const GroupNormDesc& desc,
                          const vk::BufferView& x, const vk::BufferView& gamma,
                          const vk::BufferView& beta, const vk::BufferView& y,
                          const vk::BufferView& mean, const vk::BufferView& rstd);

/// The gradients.
///
///   grad_t = silu ? grad_y * silu'(t) : grad_y           xhat = (x - mean) * rstd
///   grad_beta = sum_np grad_t                            grad_gamma = sum_np grad_t * xhat
///   grad_x = rstd * (gamma * grad_t - a - xhat * b)      a, b the group means of gamma * grad_t
///   and of gamma * grad_t * xhat
///
/// x, mean, rstd          as in the forward pass
/// grad_y, grad_x         [N,C,H,W] float32 as quads; grad_x may be grad_y; grad_x is overwritten
/// grad_gamma, grad_beta  [C]; overwritten, or added to when `accumulate`; both without a buffer if
///                        not wanted
/// sums                   workspace of group_norm_sums_bytes
/// Errors, Determinism    as the forward pass
/// Precision              gamma and beta gradients 5e-6 relative L2
/// Source                 derived in tests/ref/group_norm_ref.h
Status group_norm_backward(vk::Recorder& recorder, const GroupNormDesc& desc,
                           const vk::BufferView& x, const vk::BufferView& gamma,
                           const vk::BufferView& beta, const vk::BufferView& mean,
                           const vk::BufferView& rstd, const vk::BufferView& grad_y,
                           const vk::BufferView& grad_x, const vk::BufferView& grad_gamma,
                           const vk::BufferView& grad_beta, const vk::BufferView& sums,
                           bool accumulate);

extern const OpRow kGroupNormRow;

}  // namespace splat::ops

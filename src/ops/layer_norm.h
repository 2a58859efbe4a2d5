#pragma once

#include "ops/op_table.h"
#include "ops/quads.h"

namespace splat::ops {

struct LayerNormDesc {
    QuadDims x;
    float eps = 1e-6F;
};

/// Errors: kInvalidArgument for eps <= 0 or not finite, kUnsupported for more channels or pixels than loops can walk.
Status layer_norm_check(const LayerNormDesc& desc);

/// Layer normalisation: each pixel by itself, over its channels.
///
///   y = gamma[c] * (x - mean) * rstd + beta[c]      rstd = 1/sqrt(var + eps), var biased
///
/// x, y         [N,C,...] float32 as quads; y may be x
/// gamma, beta  [C]
/// mean         [2,N*P]  saved for backward: the rounded means, then what the rounding lost
/// rstd         [N*P]    saved for backward
/// eps          > 0, same unit as var(x)
/// Errors       those of layer_norm_check; nothing is recorded on error
/// Precision    as group_norm (tests/ops/layer_norm_test.cpp)
/// Determinism  bit-exact for any thread count
/// Source       Ba et al. 2016, arXiv:1607.06450, eq. 4, with H the channels
///
/// The gradients, with xhat = (x - mean) * rstd and a, b the means over the channels of gamma * grad_y and of
/// gamma * grad_y * xhat:
///
///   grad_x = rstd * (gamma * grad_y - a - xhat * b)
///   grad_beta = sum_np grad_y      grad_gamma = sum_np grad_y * xhat
extern const OpRow kLayerNormRow;

}  // namespace splat::ops

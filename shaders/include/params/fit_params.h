#ifndef SPLAT_FIT_PARAMS_H
#define SPLAT_FIT_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

// Adam's numbers of one step, for all parameters of a fit; the host computes them in float64.
struct FitAdam {
    float beta1;
    float rest1;  // 1 - beta1
    float beta2;
    float rest2;
    float root_scale;  // 1 / sqrt(1 - beta2^step)
    float eps;
};

struct FitAdamSetParams {
    uint gaussians;
    uint views;  // views of the rasterizer's call
    uint groups_x;
    // Step sizes, rate / (1 - beta1^step).
    float mean;
    float logit;
    float log_scale;
    float rotation;
    FitAdam adam;
};

// Specialisation constants.
SPLAT_SPEC_ID kFitColorQuadsId = 10u;   // quads of a Gaussian's colours
SPLAT_SPEC_ID kFitActiveQuadsId = 11u;  // quads of the active degree

struct FitAdamColorsParams {
    uint quads;  // active quads of all Gaussians
    uint groups_x;
    // Step sizes of the constant term and of the others.
    float constant;
    float rest;
    FitAdam adam;
};

// What fit_split does with a Gaussian.
const uint kFitKeep = 0u;
const uint kFitFirstHalf = 1u;
const uint kFitSecondHalf = 2u;

struct FitSplitParams {
    uint gaussians;
    uint groups_x;
};

// The loss of one view; kernels for CPU devices use neither chunk nor groups_x.
struct PhotoLossParams {
    uint width;
    uint height;
    uint chunk;      // pixels per workgroup that sums
    uint groups_x;   // workgroups per row of the dispatch, see src/vk/launch.h
    uint first;      // quad of `partial` where this kernel begins
    uint image;      // quad of the images and of their gradients where the view begins
    float l1_scale;  // factors of the gradients of the sums of |a - t| and of 1 - SSIM
    float ssim_scale;
};

#ifdef __cplusplus
static_assert(sizeof(FitAdamSetParams) <= 128);
}
#endif

#endif

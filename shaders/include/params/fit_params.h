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
    // Added to the gradients of each opacity and of each scale.
    float opacity_pull;
    float scale_pull;
};

// Specialisation constants.
SPLAT_SPEC_ID kFitColorQuadsId = 10u;   // quads of a Gaussian's colours
SPLAT_SPEC_ID kFitActiveQuadsId = 11u;  // quads of the active degree
SPLAT_SPEC_ID kFitSparseId = 12u;       // quads whose gradient is 0 stay as they are

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
const uint kFitShare = 3u;  // one of several in its place: another logit, scales times a factor

struct FitSplitParams {
    uint gaussians;
    uint groups_x;
};

// Noise on means.
struct FitNoiseParams {
    uint gaussians;
    uint groups_x;
    float scale;
    uint step_low;
    uint step_high;
    uint seed_low;
    uint seed_high;
};
// Specialisation constant: the image is seen through the view's exposure.
SPLAT_SPEC_ID kPhotoLossExposureId = 10u;

// The loss of one view; kernels for CPU devices use neither chunk nor groups_x.
struct PhotoLossParams {
    uint width;
    uint height;
    uint chunk;      // pixels per workgroup that sums
    uint groups_x;   // workgroups per row of the dispatch, see src/vk/launch.h
    uint first;      // quad of `partial` where this kernel begins
    uint exposures;  // the same of the sums for the exposure
    uint image;      // quad of the images and of their gradients where the view begins
    float l1_scale;  // factors of the gradients of the sums of |a - t| and of 1 - SSIM
    float ssim_scale;
    float exposure[12];  // rows of three gains and an offset
};

// The losses of one view against maps of depth and normals.
struct PriorLossParams {
    uint width;
    uint height;
    uint chunk;     // pixels per workgroup that sums
    uint groups_x;  // workgroups per row of the dispatch, see src/vk/launch.h
    uint chunks;
    uint image;  // pixel of the images where the view begins
    // The camera, pixels.
    float fx;
    float fy;
    float cx;
    float cy;
    // Factors of the gradients of the losses' sums.
    float depth_scale;
    float normal_scale;
    // How the map of depth is aligned, if that is known: inverse depth = scale p + shift, whose mean has this inverse.
    uint aligned;
    float scale;
    float shift;
    float inverse_mean;
};

#ifdef __cplusplus
static_assert(sizeof(FitAdamSetParams) <= 128 && sizeof(PhotoLossParams) <= 128);
}
#endif

#endif

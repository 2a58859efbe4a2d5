#ifndef SPLAT_CONV2D_PARAMS_H
#define SPLAT_CONV2D_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

SPLAT_SPEC_ID kConv2dOutQuadsId = 10u;  // fast backward weight: quads of output channels of a lane, up to 8

// A 3x3 convolution, stride 1, padded with one pixel on each side.
struct Conv2dParams {
    uint n;
    uint in_channels;  // for the product at hand: the gradient of the input swaps the two
    uint out_channels;
    uint height;
    uint width;
    uint has_bias;
    uint has_residual;
    float scale;
    uint accumulate;  // 1: parameter gradients are added to the existing values
    uint transposed;  // conv2d_pack_weight: 1 flips the taps and swaps the channels
    uint slices;      // conv2d_backward_weight: number of slices in which the rows of pixels are summed
    uint groups_x;    // workgroups per row of the dispatch, see src/vk/launch.h
    uint replicate;   // conv2d_forward: beyond the image is its nearest pixel, else 0
};

#ifdef __cplusplus
static_assert(sizeof(Conv2dParams) <= 128);
}
#endif

#endif

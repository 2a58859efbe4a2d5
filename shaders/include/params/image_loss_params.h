#ifndef SPLAT_IMAGE_LOSS_PARAMS_H
#define SPLAT_IMAGE_LOSS_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

// Used by edge_loss.
SPLAT_SPEC_ID kImageLossScharrId = 10u;
SPLAT_SPEC_ID kImageLossWeightedId = 11u;

// Losses of images as quads [ceil(c/4)][n * height * width].
struct ImageLossParams {
    uint n;
    uint c;
    uint height;
    uint width;
    uint quads;
    uint chunk;     // quads per workgroup of the forward pass
    float scale;    // 1 / elements
    uint groups_x;  // workgroups per row of the dispatch, see src/vk/launch.h
};

#ifdef __cplusplus
static_assert(sizeof(ImageLossParams) <= 128);
}
#endif

#endif

#ifndef SPLAT_LOSS_PARAMS_H
#define SPLAT_LOSS_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

// A mean over all elements of images that lie as quads.
struct LossParams {
    uint quads;
    uint chunk;     // quads per workgroup of the forward pass
    uint sums;      // loss_sum: partial sums, one per chunk
    float scale;    // 1 / elements
    uint groups_x;  // workgroups per row of the dispatch, see src/vk/launch.h
};

// The loss of planes of Gaussians.
struct PlaneLossParams {
    uint planes;
    float scale;    // backward: 1 / Gaussians of the scene
    uint groups_x;  // workgroups per row of the dispatch
};

#ifdef __cplusplus
static_assert(sizeof(LossParams) <= 128 && sizeof(PlaneLossParams) <= 128);
}
#endif

#endif

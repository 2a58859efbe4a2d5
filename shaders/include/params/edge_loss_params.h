#ifndef SPLAT_EDGE_LOSS_PARAMS_H
#define SPLAT_EDGE_LOSS_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

// Images as quads [ceil(c/4)][n * height * width].
struct EdgeLossParams {
    uint n;
    uint height;
    uint width;
    uint quads;
    uint chunk;     // quads per workgroup of the forward pass
    float scale;    // 1 / elements
    uint groups_x;  // workgroups per row of the dispatch, see src/vk/launch.h
    uint weighted;  // 1: `weight` is read
    float centre;   // taps of the smoothing filter: side, centre, side
    float side;
};

#ifdef __cplusplus
static_assert(sizeof(EdgeLossParams) <= 128);
}
#endif

#endif

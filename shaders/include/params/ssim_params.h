#ifndef SPLAT_SSIM_PARAMS_H
#define SPLAT_SSIM_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

// Images as quads [ceil(c/4)][n * height * width].
struct SsimParams {
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
static_assert(sizeof(SsimParams) <= 128);
}
#endif

#endif

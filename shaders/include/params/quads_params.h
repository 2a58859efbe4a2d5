#ifndef SPLAT_QUADS_PARAMS_H
#define SPLAT_QUADS_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

// x [n, c, p] row-major against quads [ceil(c/4)][n*p] of 4 channels.
struct QuadsParams {
    uint n;
    uint c;
    uint p;
    uint groups_x;  // workgroups per row of the dispatch, see src/vk/launch.h
};

#ifdef __cplusplus
static_assert(sizeof(QuadsParams) <= 128);
}
#endif

#endif

#ifndef SPLAT_RESAMPLE2D_PARAMS_H
#define SPLAT_RESAMPLE2D_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

// Specialisation constants.
SPLAT_SPEC_ID kResample2dBoxId = 10u;  // the filter is [1, 1]
SPLAT_SPEC_ID kResample2dUpId = 11u;   // to twice the size, else to half

struct Resample2dParams {
    uint planes;  // quads of channels times images
    uint height;  // size of this dispatch's input
    uint width;
    uint taps;      // taps of the filter, unless it is the box
    float gain;     // multiplies the filter outer(f, f) / sum(f)^2
    uint groups_x;  // workgroups per row of the dispatch, see src/vk/launch.h
};

#ifdef __cplusplus
static_assert(sizeof(Resample2dParams) <= 128);
}
#endif

#endif

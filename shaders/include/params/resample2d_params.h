#ifndef SPLAT_RESAMPLE2D_PARAMS_H
#define SPLAT_RESAMPLE2D_PARAMS_H

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

struct Resample2dParams {
    uint planes;  // quads of channels times images
    uint height;  // of the input of this dispatch
    uint width;
    uint taps;      // of the filter, unless it is the box
    float gain;     // multiplies the filter outer(f, f) / sum(f)^2
    uint groups_x;  // workgroups per row of the dispatch, see src/ops/launch.h
};

#ifdef __cplusplus
static_assert(sizeof(Resample2dParams) <= 128);
}
#endif

#endif

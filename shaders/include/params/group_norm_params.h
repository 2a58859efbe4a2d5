#ifndef SPLAT_GROUP_NORM_PARAMS_H
#define SPLAT_GROUP_NORM_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

struct GroupNormParams {
    uint n;       // batch
    uint c;       // channels
    uint p;       // pixels, h * w
    uint groups;  // divides c
    float eps;
    uint silu;        // 1: y = t * sigmoid(t) of the normalised t
    uint accumulate;  // 1: parameter gradients are added to the existing values
};

#ifdef __cplusplus
static_assert(sizeof(GroupNormParams) <= 128);
}
#endif

#endif

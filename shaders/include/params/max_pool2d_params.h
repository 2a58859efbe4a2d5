#ifndef SPLAT_MAX_POOL2D_PARAMS_H
#define SPLAT_MAX_POOL2D_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

struct MaxPool2dParams {
    uint planes;  // quads of channels times images
    uint height;  // size of x
    uint width;
    uint groups_x;  // workgroups per row of the dispatch, see src/vk/launch.h
};

#ifdef __cplusplus
static_assert(sizeof(MaxPool2dParams) <= 128);
}
#endif

#endif

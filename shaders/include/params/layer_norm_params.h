#ifndef SPLAT_LAYER_NORM_PARAMS_H
#define SPLAT_LAYER_NORM_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

// Specialisation constant: invocations that share a pixel, a power of two that divides the workgroup.
SPLAT_SPEC_ID kLayerNormLanesId = 10u;

struct LayerNormParams {
    uint channels;
    uint columns;  // pixels of all images
    float eps;
    uint accumulate;  // 1: gradients of gamma and beta are added to the existing values
    uint groups_x;    // workgroups per row of the dispatch, see src/vk/launch.h
};

#ifdef __cplusplus
static_assert(sizeof(LayerNormParams) <= 128);
}
#endif

#endif

#ifndef SPLAT_FEATURE_DISTANCE_PARAMS_H
#define SPLAT_FEATURE_DISTANCE_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

struct FeatureDistanceParams {
    uint channels;
    uint images;
    uint pixels;    // per image
    float scale;    // 1 / pixels
    uint groups_x;  // workgroups per row of the dispatch, see src/vk/launch.h
};

#ifdef __cplusplus
static_assert(sizeof(FeatureDistanceParams) <= 128);
}
#endif

#endif

#ifndef SPLAT_TENSOR_STATS_PARAMS_H
#define SPLAT_TENSOR_STATS_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

struct TensorStatsParams {
    uint elements;
    uint chunk;     // elements per workgroup
    uint groups_x;  // workgroups per row of the dispatch, see src/vk/launch.h
};

// The same of a set of Gaussians.
struct SetStatisticsParams {
    uint gaussians;
    uint color_quads;
    uint chunk;  // Gaussians per workgroup
    uint groups_x;
};

#ifdef __cplusplus
static_assert(sizeof(TensorStatsParams) <= 128 && sizeof(SetStatisticsParams) <= 128);
}
#endif

#endif
